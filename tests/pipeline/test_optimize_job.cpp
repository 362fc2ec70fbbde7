#include "io/mesh_io.hpp"
#include "io/scratch.hpp"
#include "pipeline/optimize_pipeline.hpp"
#include "pipeline/quality_fields.hpp"
#include "pipeline/tangled_mesh.hpp"

#include "quality/cell_quality.hpp"

#include <algorithm>
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
    REQUIRE(written->fields.size() == 4);
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

TEST_CASE("a job writes each cell's quality anew, where the format holds arrays") {
    Scratch scratch;
    const HexMesh mesh = tangled_mesh("grid", 0.2, 5);
    const std::vector<double> stale(mesh.cell_count(), 7);
    for (const char* name : {"out.vtu", "out.vtk"}) {
        OptimizeJob job = make_job(scratch, mesh, {{"scaled_jacobian", FieldLocation::cell, 1, stale}});
        job.output = scratch / name;
        Context context(1);
        REQUIRE(run_optimize_job(job, context));
        const auto written = read_mesh_file(job.output, context);
        REQUIRE(written);
        REQUIRE(written->fields.size() == 3);
        CHECK(written->fields[0].name == "scaled_jacobian");
        CHECK(written->fields[1].name == "min_dihedral");
        CHECK(written->fields[2].name == "valid");
        for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
            const CellQuality quality = compute_cell_quality(cell_points(written->mesh, c));
            CHECK(written->fields[0].values[c] == static_cast<float>(quality.validity.scaled_jacobian));
            CHECK(written->fields[1].values[c] == static_cast<float>(quality.min_dihedral));
            CHECK(written->fields[2].values[c] == 1);
        }
    }
    OptimizeJob job = make_job(scratch, mesh);
    job.output = scratch / "out.mesh";
    Context context(1);
    std::vector<std::string> said;
    context.set_log_sink([&](LogLevel level, std::string_view text) {
        if (level != LogLevel::debug) said.emplace_back(text);
    });
    REQUIRE(run_optimize_job(job, context));
    for (const std::string& line : said) CHECK(line.find("scaled_jacobian") == std::string::npos);
}

TEST_CASE("what is concave is not marked valid") {
    HexMesh mesh = tangled_mesh("grid", 0.2, 5);
    std::vector<FieldData> fields;
    add_quality_fields(fields, "mesh.vtu", mesh, Parallel(2));
    const auto& valid = fields.at(2).values;
    std::size_t usable = 0;
    for (std::size_t c = 0; c < mesh.cell_count(); ++c)
        usable += compute_cell_validity(cell_points(mesh, c)).is_usable();
    CHECK(static_cast<std::size_t>(std::count(valid.begin(), valid.end(), 1.0)) == usable);
    CHECK(usable < mesh.cell_count());
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
