#include "io/cad_samples.hpp"
#include "io/scratch.hpp"
#include "pipeline/follow_borders.hpp"
#include "pipeline/mesh_pipeline.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

using namespace hexopt;

namespace {

MeshJob nose_job(const test::Scratch& scratch, double size) {
    test::spill(scratch / "nose.step", test::step_of_nose());
    MeshJob job;
    job.surfaces = {scratch / "nose.step"};
    job.output = scratch / "nose.vtu";
    job.report = scratch / "nose.json";
    job.options.refine.surface.size = size;
    return job;
}

/// Vertices of the mesh on the line x = y = 0.
std::size_t count_on_nose(const HexMesh& mesh) {
    return static_cast<std::size_t>(
        std::count_if(mesh.positions.begin(), mesh.positions.end(),
                      [](const Point& p) { return std::abs(p.x) < 1e-9 && std::abs(p.y) < 1e-9; }));
}

} // namespace

TEST_CASE("the nose of a wing in a CAD file gets edges of the mesh") {
    const test::Scratch scratch;
    Context context(2);
    for (const bool weak : {true, false}) {
        MeshJob job = nose_job(scratch, 0.1);
        job.options.weak_features = weak;
        const auto result = run_mesh_job(job, context);
        REQUIRE(result);
        CHECK(result->outcome.verdict == ErrorCode::ok);
        CHECK(result->outcome.followed_borders == (weak ? 1 : 0));
        const auto report = nlohmann::json::parse(test::slurp(job.report));
        CHECK(report["surface"]["followed_borders"] == (weak ? 1 : 0));
        if (weak)
            CHECK(count_on_nose(result->outcome.mesh) >= 10);
        else
            CHECK(count_on_nose(result->outcome.mesh) < 5);
    }
}

TEST_CASE("borders that are followed are found again when a run is resumed") {
    const test::Scratch scratch;
    MeshJob job = nose_job(scratch, 0.15);
    job.checkpoint = scratch / "state";
    std::vector<std::string> states;
    Context context(1);
    context.set_progress_sink([&](std::string_view, double, std::string_view) {
        const std::string bytes = test::slurp(job.checkpoint / "mesh.checkpoint");
        if (!bytes.empty() && (states.empty() || states.back() != bytes)) states.push_back(bytes);
    });
    const auto whole = run_mesh_job(job, context);
    REQUIRE(whole);
    REQUIRE(whole->outcome.followed_borders == 1);
    const std::string mesh = test::slurp(job.output);
    REQUIRE(states.size() > 2);
    job.resume = true;
    Context again(1);
    for (const std::string& state : states) {
        test::spill(job.checkpoint / "mesh.checkpoint", state);
        const auto resumed = run_mesh_job(job, again);
        INFO((resumed ? "" : resumed.error().one_line()));
        REQUIRE(resumed);
        CHECK(resumed->outcome.followed_borders == 1);
        CHECK(test::slurp(job.output) == mesh);
    }
}
