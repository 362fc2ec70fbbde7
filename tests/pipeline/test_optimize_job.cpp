#include "io/mesh_io.hpp"
#include "io/scratch.hpp"
#include "pipeline/optimize_pipeline.hpp"
#include "pipeline/tangled_mesh.hpp"

#include <nlohmann/json.hpp>

using namespace hexopt;
using namespace hexopt::test;

namespace {

OptimizeJob make_job(const Scratch& scratch, const HexMesh& mesh, std::vector<FieldData> fields = {}) {
    Context context(1);
    REQUIRE(write_mesh(scratch / "in.vtu", mesh, fields, {}, context));
    OptimizeJob job;
    job.input = scratch / "in.vtu";
    job.output = scratch / "out.vtu";
    job.report = scratch / "report.json";
    return job;
}

} // namespace

TEST_CASE("a job writes the mesh it measured, keeps the input's arrays, and reports") {
    Scratch scratch;
    const HexMesh mesh = tangled_mesh("grid", 0.2, 5);
    std::vector<double> numbers(mesh.cell_count());
    for (std::size_t c = 0; c < numbers.size(); ++c) numbers[c] = static_cast<double>(c % 7);
    const OptimizeJob job = make_job(scratch, mesh, {{"region", FieldLocation::cell, 1, numbers}});
    Context context(1);
    const auto result = run_optimize_job(job, context);
    REQUIRE(result);
    CHECK(result->written == std::vector<std::filesystem::path>{job.output, job.report});

    const auto written = read_mesh_file(job.output, context);
    REQUIRE(written);
    CHECK(written->mesh.cells == mesh.cells);
    const ValidityCounts counts = compute_validity(written->mesh, context.parallel());
    CHECK(counts.is_valid());
    CHECK(counts.min_scaled_jacobian == result->outcome.after.validity.min_scaled_jacobian);
    REQUIRE(written->fields.size() == 1);
    CHECK(written->fields[0].values == numbers);

    const auto report = nlohmann::json::parse(slurp(job.report));
    CHECK(report["verdict"] == "ok");
    CHECK(report["quality_before"]["validity"]["concave32"] == result->outcome.before.validity.concave_cells);
    CHECK(report["quality_after"]["validity"]["is_valid"] == true);
    CHECK(report["deviation"]["largest_rel"].get<double>() < 1e-12);
    CHECK(report["deviation"]["within_tenth_h_pct"].get<double>() == 100);
    std::vector<std::string> stages;
    for (const auto& stage : report["stages"]) {
        stages.push_back(stage["stage"]);
        CHECK(stage["cpu_seconds"].get<double>() >= 0);
        CHECK(stage["peak_memory_bytes"].get<std::uint64_t>() > 0);
    }
    CHECK(stages == std::vector<std::string>{"read", "device", "structure", "hanging", "topology",
                                             "quality_before", "surface", "optimize", "quality_after",
                                             "deviation", "write"});
}

TEST_CASE("a cancelled job writes only if asked to") {
    const HexMesh mesh = tangled_mesh("scrambled-cube", 0, 6);
    for (const bool keep_best : {false, true}) {
        Scratch scratch;
        OptimizeJob job = make_job(scratch, mesh);
        job.keep_best = keep_best;
        Context context(1);
        context.set_progress_sink([&](std::string_view stage, double, std::string_view) {
            if (stage == "max-min") context.cancel();
        });
        const auto result = run_optimize_job(job, context);
        REQUIRE(result);
        CHECK(result->outcome.verdict == ErrorCode::cancelled);
        CHECK(std::filesystem::exists(job.output) == keep_best);
        CHECK(std::filesystem::exists(job.report) == keep_best);
    }
}

TEST_CASE("an output that cannot be written is found before anything is computed") {
    Scratch scratch;
    OptimizeJob job = make_job(scratch, tangled_mesh("grid", 0, 2));
    std::vector<std::string> stages;
    Context context(1);
    context.set_progress_sink(
        [&](std::string_view stage, double, std::string_view) { stages.emplace_back(stage); });
    job.report = scratch / "no/such/folder.json";
    const auto result = run_optimize_job(job, context);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::output_failed);
    CHECK(stages.empty());
}
