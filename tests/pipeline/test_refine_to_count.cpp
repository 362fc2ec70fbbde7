// Whether meshes get as many cells as they were asked for, buffer layers and repairs included.
#include "pipeline/refine_to_count.hpp"
#include "refine/surfaces.hpp"
#include "samples/geometry/geometries.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

/// Everything before the optimizer.
Result<MeshOutcome> shape(const TriangleSoup& soup, const MeshOptions& options) {
    StageClock clock;
    Context context(1);
    context.set_progress_sink([&](std::string_view stage, double, std::string_view) {
        if (stage == "optimize") context.cancel();
    });
    return mesh_surface(soup, options, clock, context);
}

void check_count(const char* name, double wanted) {
    CAPTURE(name, wanted);
    Context context(1);
    const auto soup = make_geometry(name, {24, ""}, context);
    REQUIRE(soup);
    MeshOptions options;
    options.refine.target_cells = wanted;
    const auto outcome = shape(*soup, options);
    INFO((outcome ? "" : outcome.error().one_line()));
    REQUIRE(outcome);
    const double ratio = static_cast<double>(outcome->mesh.cell_count()) / wanted;
    CHECK(ratio < 1.6);
    CHECK(ratio > 1 / 1.6);
}

} // namespace

TEST_CASE("the finished mesh has about as many cells as wanted") {
    for (const char* name : {"cylinder", "ahmed"}) check_count(name, 4000);
}

TEST_CASE("samples of every kind get about as many cells as wanted", "[slow]") {
    for (const char* name : {"cylinder", "volute", "missile", "ahmed"}) check_count(name, 5000);
    check_count("three-pipe-joint", 12e3);
}

TEST_CASE("room for repairs is left, but not for many times the cells") {
    Context context(1);
    const auto soup = make_geometry("cylinder", {24, ""}, context);
    REQUIRE(soup);
    const Domain domain = test::make_domain(*soup);
    MeshOptions options;
    options.refine.target_cells = 4000;
    auto refined = refine_to_count(domain, options, context, nullptr);
    REQUIRE(refined);
    const std::size_t before = refined->octree.cell_count();
    CHECK(refined->max_cells > before);
    CHECK(refined->max_cells < before + 4000);
    std::vector<Index> all(before);
    for (Index c = 0; c < before; ++c) all[c] = c;
    const RefineCount count = refine_cells(*refined, all, context);
    CHECK(count.over_budget);
    CHECK(refined->stats.repairs_over_budget > before / 2);
    CHECK(refined->octree.cell_count() <= refined->max_cells);
}

TEST_CASE("a given size is taken as it is") {
    Context context(1);
    const Domain domain = test::make_domain(test::make_sphere(1, 12));
    MeshOptions options;
    options.refine.surface.size = 0.2;
    const auto refined = refine_to_count(domain, options, context, nullptr);
    REQUIRE(refined);
    CHECK(refined->stats.surface_size == 0.2);
    CHECK(refined->max_cells == options.refine.max_cells);
    CHECK(refined->octree.cells == refine(domain, options.refine, context)->octree.cells);
    CHECK_FALSE(refine_at(domain, options.refine, 0.2, context));
    options.refine.surface.size = 0;
    CHECK_FALSE(refine_at(domain, options.refine, 0, context));
    CHECK(refine_at(domain, options.refine, 0.3, context)->stats.surface_size == 0.3);
}
