// What becomes of walls thinner than the cells that were asked for.
#include "pipeline/mesh_surface.hpp"
#include "pipeline/trim_rounds.hpp"
#include "refine/surfaces.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

TriangleSoup two_plates(double thickness) {
    TriangleSoup plates;
    test::append_box(plates, {0, 0, 0}, {12, 12, thickness});
    test::append_box(plates, {0, 0, 3}, {12, 12, 3 + thickness});
    return plates;
}

/// A block with a plate beside it, as one surface.
TriangleSoup block_and_plate(double thickness) {
    TriangleSoup soup;
    test::append_box(soup, {0, 0, 0}, {6, 6, 6});
    test::append_box(soup, {7.3, 0, 0}, {7.3 + thickness, 12, 12});
    return soup;
}

RefineOptions cells_of(double size, int gap_levels) {
    RefineOptions options;
    options.surface.size = size;
    options.gap_cells = options.wall_cells = options.feature_cells = 0; // only what trimming finds
    options.gap_levels = gap_levels;
    return options;
}

TrimOutput trim_all(const Domain& domain, const RefineOptions& options, int narrow_levels = 0,
                    double thinnest_wall_h = 0) {
    Context context(1);
    auto refined = refine(domain, options, context);
    if (!refined) FAIL(refined.error().one_line());
    TrimRounds rounds;
    TrimOptions how;
    how.part_fraction = 0; // parts of any size are wanted
    how.thinnest_wall_h = thinnest_wall_h;
    auto trimmed =
        trim_in_rounds(*refined, domain, how, options.max_cells, rounds, context, nullptr, narrow_levels);
    if (!trimmed) FAIL(trimmed.error().one_line());
    CHECK(rounds.count > 0);
    CHECK((trimmed->report.surface_quads > 0) == (trimmed->report.kept_cells > 0));
    return std::move(trimmed).value();
}

} // namespace

TEST_CASE("a wall of half a cell is refined until cells follow it, and nothing else is") {
    const Domain domain = test::make_domain(block_and_plate(0.5));
    const TrimOutput coarse = trim_all(domain, cells_of(1, 0));
    CHECK(coarse.report.bare_area > 0.3 * coarse.report.surface_area);
    const TrimOutput fine = trim_all(domain, cells_of(1, 2));
    CHECK(fine.report.bare_area == 0);
    CHECK(fine.report.kept_volume == Approx(6 * 6 * 6 + 144 * 0.5).epsilon(0.3));
    CHECK(fine.refine_cells.empty());
    CHECK(fine.report.closed_manifold());
    CHECK(check_coverage(fine));
    const auto deepest = [](const HexMesh& mesh) {
        int level = 0;
        for (std::size_t c = 0; c < mesh.cell_count(); ++c)
            if (mesh.positions[mesh.cells[c][0]].x < 4) level = std::max<int>(level, mesh.level[c]);
        return level;
    };
    CHECK(deepest(fine.kept) == deepest(coarse.kept)); // the block keeps its size
}

TEST_CASE(
    "a wall that may not be refined gets a layer of the cells that there are, or of as few levels as do") {
    const Domain half = test::make_domain(block_and_plate(0.5)),
                 tenth = test::make_domain(block_and_plate(0.1));
    const TrimOutput coarse = trim_all(half, cells_of(1, 0)), layer = trim_all(half, cells_of(1, 0), 0, 0.25);
    CHECK(coarse.report.bare_area > 0.3 * coarse.report.surface_area);
    CHECK(layer.report.bare_area == 0);
    CHECK(layer.report.wall_cells > 100);
    CHECK(layer.report.octree_cells == coarse.report.octree_cells);
    CHECK(layer.report.closed_manifold());
    // Where it is refined as far as cells that are kept by their centres need, there is nothing left to do.
    CHECK(trim_all(half, cells_of(1, 2), 0, 0.25).report.wall_cells == 0);

    const TrimOutput too_thin = trim_all(tenth, cells_of(1, 0), 0, 0.25);
    CHECK(too_thin.report.wall_cells == 0);
    CHECK(too_thin.report.bare_area > 0.3 * too_thin.report.surface_area);
}

TEST_CASE("layers that leave most of what was bare as it was are given up") {
    const auto block_and_wedge = [](double thickness) { // 0.02 thick at its other end
        TriangleSoup soup = block_and_plate(thickness);
        for (Point& p : soup.vertices)
            if (p.x > 7.4 && p.z < 1) p.x = 7.32;
        return test::make_domain(soup);
    };
    const TrimReport half = trim_all(block_and_wedge(0.6), cells_of(1, 0), 0, 0.25).report,
                     end = trim_all(block_and_wedge(0.28), cells_of(1, 0), 0, 0.25).report;
    CHECK(half.wall_cells > 50);
    CHECK(end.wall_cells == 0);
    CHECK(end.bare_area > 0.9 * 2 * 144);
    CHECK(end.closed_manifold());
}

TEST_CASE(
    "layers are for places that go on farther than fitting reaches, whatever their share of the surface") {
    const auto trim_tab = [](double side) {
        TriangleSoup soup;
        test::append_box(soup, {0, 0, 0}, {110, 110, 2});
        test::append_box(soup, {50, 50, 7.3}, {50 + side, 50 + side, 7.8});
        return trim_all(test::make_domain(soup), cells_of(1, 0), 0, 0.25).report;
    };
    const TrimReport small = trim_tab(0.9), large = trim_tab(4);
    CHECK(small.wall_cells == 0);
    CHECK(small.bare_area > 0);
    CHECK(large.wall_cells > 8);
    CHECK(large.bare_area == 0);
    CHECK(large.parts == 2);
}

TEST_CASE("narrow parts get cells beyond the levels of gaps, as far as that does not take many") {
    const auto block_and_tab = [](double side, double thickness) {
        TriangleSoup soup;
        test::append_box(soup, {0, 0, 0}, {10, 10, 10});
        test::append_box(soup, {10.6, 4.1, 4.1}, {10.6 + thickness, 4.1 + side, 4.1 + side});
        return test::make_domain(soup);
    };
    SECTION("a small tab of half a cell") {
        const Domain domain = block_and_tab(0.4, 0.12);
        const TrimOutput none = trim_all(domain, cells_of(0.25, 0)),
                         some = trim_all(domain, cells_of(0.25, 0), 3);
        CHECK(none.report.bare_area > 0.4);
        CHECK(some.report.bare_area == 0);
        CHECK(some.report.closed_manifold());
        CHECK(some.report.octree_cells < 1.5 * none.report.octree_cells);
        // Cells of a third of the thickness ask for three levels.
        CHECK(trim_all(domain, cells_of(0.25, 0), 2).report.octree_cells == none.report.octree_cells);
    }
    SECTION("a large one") {
        const Domain domain = block_and_tab(5, 0.05);
        const TrimOutput none = trim_all(domain, cells_of(0.25, 0)),
                         some = trim_all(domain, cells_of(0.25, 0), 5);
        CHECK(some.report.bare_area > 40);
        CHECK(some.report.octree_cells == none.report.octree_cells);
    }
}

TEST_CASE("layers in walls have room where other narrow parts have taken theirs") {
    TriangleSoup soup;
    test::append_box(soup, {0, 0, 0}, {10, 10, 10});
    test::append_box(soup, {-0.7, 3.1, 3.1}, {-0.65, 6.45, 6.45}); // a fifth of a cell
    const Domain wall = test::make_domain(soup);
    for (const double y : {1.1, 2.6, 4.1, 5.6, 7.1})
        test::append_box(soup, {10.6, y, 2 * y - 2}, {10.72, y + 0.43, 2 * y - 1.57});
    const Domain with_tabs = test::make_domain(soup);
    const RefineOptions cells = cells_of(0.25, 0);
    CHECK(trim_all(wall, cells, 3, 0.25).report.bare_area < 0.5);
    const double first = static_cast<double>(trim_all(with_tabs, cells).report.octree_cells);
    const TrimReport tabs = trim_all(with_tabs, cells, 3).report,
                     all = trim_all(with_tabs, cells, 3, 0.25).report;
    CHECK(static_cast<double>(tabs.octree_cells) > 1.15 * first);
    CHECK(static_cast<double>(tabs.octree_cells) < 1.3 * first);
    CHECK(tabs.bare_area > 20);
    CHECK(all.bare_area == 0);
    CHECK(static_cast<double>(all.octree_cells) > 1.32 * first); // rings round the wall besides
    CHECK(static_cast<double>(all.octree_cells) < 1.45 * first);
}

TEST_CASE("a wall that no allowed level resolves is left alone and refused") {
    const Domain domain = test::make_domain(block_and_plate(0.05));
    const TrimOutput none = trim_all(domain, cells_of(1, 0)), two = trim_all(domain, cells_of(1, 2));
    CHECK(two.report.octree_cells == none.report.octree_cells);
    CHECK(two.report.bare_area > 0.3 * two.report.surface_area);
    CHECK(describe_bare_surface(two.report).find("has no cells near it") != std::string::npos);

    StageClock clock;
    Context context(1);
    MeshOptions options;
    options.refine = cells_of(1, 2);
    const auto refused = mesh_surface(block_and_plate(0.05), options, clock, context);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::no_valid_mesh);
    CHECK(refused.error().one_line().find("0.05 thick") != std::string::npos);
    CHECK(refused.error().one_line().find("--size 0.033") != std::string::npos);
}

TEST_CASE("a surface that is too thin for any cell is refused with its thickness, whatever asks for cells",
          "[slow]") {
    MeshOptions options;
    SECTION("a size") { options.refine = cells_of(1, 0); }
    SECTION("a few of them") { options.refine.target_cells = 2000; }
    SECTION("many of them") { options.refine.target_cells = 50000; }
    StageClock clock;
    Context context(1);
    const auto refused = mesh_surface(two_plates(0.02), options, clock, context);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::no_valid_mesh);
    CHECK(refused.error().one_line().find("near (") != std::string::npos);
    CHECK(refused.error().one_line().find("0.02 thick") != std::string::npos);
}

TEST_CASE("a refusal names a place with its own thickness and cells, and sizes that are smaller than these") {
    TrimOutput trimmed;
    trimmed.report.kept_cells = trimmed.report.octree_cells = 1000;
    trimmed.report.surface_area = 100;
    trimmed.report.bare_area = 40;
    const auto spot = [](double x, double cell_size, double thickness) {
        return BareSpot{Point(x, 0, 0), 0, 0, 10, cell_size, thickness, 0};
    };
    const auto refusal = [&] { return check_coverage(trimmed).error().one_line(); };
    const auto says = [&](const char* text) { return refusal().find(text) != std::string::npos; };
    trimmed.bare_spots = {spot(1, 0.1, 8), spot(2, 4, 3), spot(3, 2, 6)};
    CHECK(says("near (2, 0, 0)"));
    CHECK(says("is 3 thick there, the cells are 4; try --size 2"));
    CHECK_FALSE(says("--cells")); // 100 are fewer than there are
    trimmed.bare_spots[1].thickness = 0.33;
    CHECK(says("try --size 0.22, or --cells 8300"));
    trimmed.bare_spots = {spot(1, 0.1, 8)};
    CHECK(says("is 8 thick there, the cells are 0.1; try other --cells"));
}

TEST_CASE("what cells would be kept in a sheet is told before they are halved") {
    TriangleSoup sheet;
    test::append_box(sheet, {0, 0, 0}, {6, 6, 0.05});
    for (Point& p : sheet.vertices) p = Point(p.x - 0.3 * p.z, 0.8 * p.y - 0.6 * p.z, 0.6 * p.y + 0.8 * p.z);
    const Domain domain = test::make_domain(sheet);
    RefineOptions fine = cells_of(0.4, 4);
    Context context(1);
    auto refined = refine(domain, fine, context);
    REQUIRE(refined);
    TrimOptions how;
    how.thinnest_wall_h = 0;
    TrimRounds first, all;
    const auto early =
        trim_in_rounds(*refined, domain, how, fine.max_cells, first, context, nullptr, 0, 2000);
    REQUIRE(early);
    CHECK(first.count == 1);
    CHECK(early->report.bare_area > 0.9 * early->report.surface_area);
    const double promised = kept_once_halved(*refined, *early);
    CHECK(promised > 2000);
    const auto halved = trim_in_rounds(*refined, domain, how, fine.max_cells, all, context, nullptr, 0, 1e9);
    REQUIRE(halved);
    CHECK(all.count > 1);
    CHECK(kept_once_halved(*refined, *halved) == 0);
    const auto kept = static_cast<double>(halved->report.kept_cells);
    CHECK(promised > kept / 3);
    CHECK(promised < kept * 3);
}

TEST_CASE("walls that fit between the planes of the lattice are meshed one cell thick, without layers") {
    MeshOptions options;
    options.refine = cells_of(0.4, 0);
    StageClock clock;
    Context context(1);
    const auto meshed = mesh_surface(two_plates(0.4), options, clock, context);
    REQUIRE(meshed);
    REQUIRE(meshed->buffer);
    CHECK(meshed->buffer->spared == 12);
    CHECK(meshed->buffer->groups == 0);
    CHECK(meshed->after.validity.is_valid());
    CHECK(meshed->after.validity.min_scaled_jacobian > 0.9);
    CHECK(meshed->contacts.empty());
}

TEST_CASE("a box meshed from a box of its own planes is nowhere bare") {
    // Rounding leaves slivers of the surface in the cells beside those whose sides it lies in; they were
    // taken for bare and refined. Vertices in rows, not round the faces: it hangs on the diagonals.
    TriangleSoup cube;
    for (int v = 0; v < 8; ++v) cube.vertices.emplace_back(v & 1, v >> 1 & 1, v >> 2);
    for (const auto& f : {Quad{0, 4, 6, 2}, Quad{1, 3, 7, 5}, Quad{0, 1, 5, 4}, Quad{2, 6, 7, 3},
                          Quad{0, 2, 3, 1}, Quad{4, 5, 7, 6}}) {
        cube.triangles.push_back({f[0], f[1], f[2]});
        cube.triangles.push_back({f[0], f[2], f[3]});
    }
    const Domain domain = test::make_domain(cube);
    for (int level = 0; level <= 3; ++level) {
        CAPTURE(level);
        RefineOptions options;
        options.initial.box = Box{Point(0), Point(1)};
        options.surface.level = level;
        Context context(1);
        const auto refined = refine(domain, options, context);
        REQUIRE(refined);
        const TrimOutput trimmed = trim_all(domain, options);
        CHECK(trimmed.bare_spots.empty());
        CHECK(trimmed.report.kept_cells == refined->octree.cell_count());
    }
}

TEST_CASE("what partial faces ask for has room beyond that of repairs, up to the budget") {
    // A plane at a small angle to the lattice, with a region of small cells half-way across it.
    TriangleSoup soup;
    test::append_box(soup, {0, 0, 0}, {10, 10, 3});
    for (Point& p : soup.vertices) p = {p.x, p.y, p.z + 0.45 * p.x + 0.3 * p.y};
    const Domain domain = test::make_domain(soup);
    RefineOptions options = cells_of(0.6, 0);
    RegionTarget region;
    region.shape = RegionShape::sphere;
    region.low = {5.2, 4.7, 4.1};
    region.radius = 2.3;
    region.target.size = 0.15;
    options.regions.push_back(region);
    const auto trim_with = [&](std::size_t budget) {
        Context context(1);
        auto refined = refine(domain, options, context);
        if (!refined) FAIL(refined.error().one_line());
        refined->max_cells = refined->octree.cell_count(); // repairs have no room
        TrimRounds rounds;
        TrimOptions how;
        auto trimmed = trim_in_rounds(*refined, domain, how, std::max(budget, refined->octree.cell_count()),
                                      rounds, context, nullptr);
        if (!trimmed) FAIL(trimmed.error().one_line());
        CHECK(refined->max_cells <= refined->octree.cell_count());
        CHECK(trimmed->report.closed_manifold());
        return std::pair(std::move(trimmed).value(), rounds.count);
    };
    const auto [with_room, rounds] = trim_with(1'000'000);
    CHECK(rounds > 1);
    CHECK(with_room.report.partial_removed == 0);
    const auto [without, few] = trim_with(0);
    CHECK(without.report.partial_removed > 0);
    CHECK(without.report.octree_cells < with_room.report.octree_cells);
    CHECK(without.report.kept_volume < with_room.report.kept_volume);
}
