// Whether meshes get as many cells as they were asked for, buffer layers and repairs included.
#include "pipeline/refine_to_count.hpp"

#include "domain/tapered_chamfer.hpp"
#include "pipeline/narrow_features.hpp"
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

/// A cylinder and its octree for 4,000 cells.
struct Cylinder {
    Context context{1};
    Domain domain = test::make_domain(make_geometry("cylinder", {24, ""}, context).value());
    MeshOptions options = [] {
        MeshOptions cells;
        cells.refine.target_cells = 4000;
        return cells;
    }();
    Result<CountedOctree> counted = [&] {
        StageClock clock;
        return refine_to_count(domain, options, clock, context, nullptr);
    }();
};

} // namespace

TEST_CASE("the finished mesh has about as many cells as wanted") {
    for (const char* name : {"cylinder", "ahmed"}) check_count(name, 4000);
}

TEST_CASE("samples of every kind get about as many cells as wanted", "[slow]") {
    for (const char* name : {"cylinder", "volute", "missile", "ahmed"}) check_count(name, 5000);
    check_count("three-pipe-joint", 12e3);
}

TEST_CASE("room for repairs is left, but not for many times the cells") {
    Cylinder cylinder;
    REQUIRE(cylinder.counted);
    RefineOutput* refined = &cylinder.counted->refined;
    const std::size_t before = refined->octree.cell_count();
    CHECK(refined->max_cells > before);
    CHECK(refined->max_cells < before + 4000);
    std::vector<Index> all(before);
    for (Index c = 0; c < before; ++c) all[c] = c;
    const RefineCount count = refine_cells(*refined, all, cylinder.context);
    CHECK(count.over_budget);
    CHECK(refined->stats.repairs_over_budget > before / 2);
    CHECK(refined->octree.cell_count() <= refined->max_cells);
}

TEST_CASE("a given size is taken as it is") {
    Context context(1);
    const Domain domain = test::make_domain(test::make_sphere(1, 12));
    MeshOptions options;
    options.refine.surface.size = 0.2;
    StageClock clock;
    const auto counted = refine_to_count(domain, options, clock, context, nullptr);
    REQUIRE(counted);
    const RefineOutput* refined = &counted->refined;
    CHECK(refined->stats.surface_size == 0.2);
    CHECK(refined->max_cells == options.refine.max_cells);
    CHECK(refined->octree.cells == refine(domain, options.refine, context)->octree.cells);
    CHECK_FALSE(counted->trimmed);
}

TEST_CASE("sizes can be tried one after another, each as if it were alone") {
    Context context(1);
    const Domain domain = test::make_domain(test::make_sphere(1, 12));
    RefineOptions options;
    options.surface.size = 0.2;
    CHECK_FALSE(SizeTrials::create(domain, options, context));
    options.surface.size = 0;
    auto trials = SizeTrials::create(domain, options, context);
    REQUIRE(trials);
    CHECK_FALSE(trials->refine_to(0));
    CHECK(trials->first_size(100) > trials->first_size(1000));
    const auto small = trials->refine_to(0.2), large = trials->refine_to(0.4);
    auto again = trials->refine_to(0.2);
    REQUIRE((small && large && again));
    CHECK(small->cut > large->cut);
    CHECK(small->inside > large->inside);
    CHECK(again->inside == small->inside);
    CHECK(again->out.refinement.leaves() == small->out.refinement.leaves());
    const RefineOutput finished = trials->finish(std::move(*again));
    CHECK(finished.stats.surface_size == 0.2);
    CHECK(finished.octree.cell_count() == small->out.refinement.leaf_count());
}

TEST_CASE("the octree that was counted is not trimmed and fitted again") {
    Cylinder cylinder;
    auto& [context, domain, options, counted] = cylinder;
    REQUIRE((counted && counted->trimmed && counted->fitted));
    TrimRounds rounds;
    auto trimmed = trim_in_rounds(counted->refined, domain, options.trim, options.refine.max_cells, rounds,
                                  context, nullptr);
    REQUIRE(trimmed);
    CHECK(trimmed->kept_cell == counted->trimmed->kept_cell);
    const auto fitted = fit_boundary(std::move(trimmed->kept), domain, options.fit, context);
    REQUIRE(fitted);
    CHECK(fitted->fitted.mesh.positions == counted->fitted->fitted.mesh.positions);
    CHECK(fitted->fitted.mesh.cells == counted->fitted->fitted.mesh.cells);
}

TEST_CASE("narrow features are given up before cells are counted, and what was fitted without them is kept") {
    Context context(1);
    BoundaryOptions features;
    features.feature_angle_deg = 20;
    const auto domain = build_domain(test::tapered_chamfer(), features, context);
    REQUIRE(domain);
    MeshOptions options;
    options.refine.target_cells = 3000;
    StageClock clock;
    auto counted = refine_to_count(*domain, options, clock, context, nullptr);
    REQUIRE((counted && counted->trimmed && counted->fitted));
    REQUIRE(counted->narrow.narrow.size() == 1);
    CHECK(counted->narrow.narrow == find_narrow_features(*domain, counted->refined.octree, options).narrow);
    const auto own = leave_out(*domain, counted->narrow, context);
    REQUIRE((own && *own));
    CHECK((*own)->model.curve_count() + 1 == domain->model.curve_count() + counted->narrow.cuts.size());
    TrimRounds rounds;
    auto trimmed = trim_in_rounds(counted->refined, *domain, trim_options(options), options.refine.max_cells,
                                  rounds, context, nullptr);
    REQUIRE(trimmed);
    const auto fitted = fit_boundary(std::move(trimmed->kept), **own, options.fit, context);
    REQUIRE(fitted);
    CHECK(fitted->fitted.mesh.positions == counted->fitted->fitted.mesh.positions);
    CHECK(fitted->refine_cells == counted->fitted->refine_cells);
    options.feature_lines.emplace_back();
    CHECK(find_narrow_features(*domain, counted->refined.octree, options).narrow.empty());
}

TEST_CASE("layers are counted at the size itself, not on a small mesh") {
    // A pipe's layers end some cells from its rims: the fewer a quad the smaller the cells.
    Context context(1);
    const auto soup = make_geometry("three-pipe-joint", {48, ""}, context);
    REQUIRE(soup);
    MeshOptions options;
    options.refine.target_cells = 100e3;
    const auto outcome = shape(*soup, options);
    REQUIRE(outcome);
    CHECK(outcome->mesh.cell_count() > 0.87 * 100e3);
    CHECK(outcome->mesh.cell_count() < 1.22 * 100e3);
}
