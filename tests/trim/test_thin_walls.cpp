// Walls thinner than the cells: which cells are kept in their middle.
#include "core/random.hpp"
#include "refine/surfaces.hpp"
#include "stages/trim/coverage.hpp"
#include "stages/trim/thin_walls.hpp"
#include "support/shapes.hpp"
#include "trim/surface_octree.hpp"

#include <catch2/catch.hpp>
#include <tuple>

using namespace hexopt;

namespace {

/// A plate of 16 by 12 and so thick, turned.
Domain make_plate(double thickness, const glm::dmat3& turn) {
    TriangleSoup soup;
    test::append_box(soup, {-8, -6, -0.5 * thickness}, {8, 6, 0.5 * thickness});
    for (Point& p : soup.vertices) p = turn * p;
    return test::make_domain(soup);
}

/// Cells of size 1 round a surface.
HexMesh make_cells(const Domain& domain, double offset) {
    const Box box = surface_box(domain.model);
    const Point extent = box.high - box.low;
    const double longest = std::max({extent.x, extent.y, extent.z});
    SurfaceOctree octree = octree_round(box, static_cast<std::uint32_t>(std::lround(longest)), offset);
    return octree.make(0, [](const Point&, double, int) { return false; });
}

TrimOutput trim_with(const HexMesh& octree, const Domain& domain, double thinnest_wall_h,
                     bool whole_layers = false) {
    Context context(1);
    TrimOptions options;
    options.whole_layers = whole_layers;
    options.thinnest_wall_h = thinnest_wall_h;
    Result<TrimOutput> out = trim(octree, domain, options, context);
    if (!out) FAIL(out.error().one_line());
    return std::move(out).value();
}

} // namespace

TEST_CASE("plates thinner than a cell get a closed layer of cells, in any direction") {
    Random random(5);
    for (const double thickness : {0.3, 0.5, 0.8, 1.1})
        for (int round = 0; round < 4; ++round) {
            CAPTURE(thickness, round);
            const glm::dmat3 turn = round == 0 ? glm::dmat3(1) : random_rotation(random);
            const Domain domain = make_plate(thickness, turn);
            const HexMesh octree = make_cells(domain, 0.37);
            const TrimOutput without = trim_with(octree, domain, 0), with = trim_with(octree, domain, 0.25);
            const double area = without.report.surface_area;
            CHECK(with.report.closed_manifold());
            CHECK(with.report.bare_area <= without.report.bare_area);
            CHECK(with.report.bare_area < 0.1 * area); // at most a strip at the edges
            CHECK(with.report.parts == 1);
            for (const Cell& cell : with.kept.cells) {
                double least = 1e9, most = -1e9;
                for (Index v : cell) {
                    const double z = (glm::transpose(turn) * with.kept.positions[v]).z;
                    least = std::min(least, z);
                    most = std::max(most, z);
                }
                REQUIRE(least < 0.5 * thickness);
                REQUIRE(most > -0.5 * thickness);
            }
            if (without.report.bare_area > 0.2 * area) CHECK(with.report.wall_cells > 100);
        }
}

TEST_CASE("walls thinner than the limit, and surfaces with cells all over, are left as they are") {
    const Domain plate = make_plate(0.2, glm::dmat3(1)), slab = make_plate(2.3, glm::dmat3(1));
    for (const Domain* domain : {&plate, &slab}) {
        const HexMesh octree = make_cells(*domain, 0.37);
        const TrimOutput without = trim_with(octree, *domain, 0), with = trim_with(octree, *domain, 0.25);
        CHECK(with.report.wall_cells == 0);
        CHECK(with.kept_cell == without.kept_cell);
        CHECK(with.report.bare_area == without.report.bare_area);
    }
}

TEST_CASE("the strict rule keeps no cells of thin walls, and the limit has a range") {
    const Domain domain = make_plate(0.5, glm::dmat3(1));
    const HexMesh octree = make_cells(domain, 0.37);
    Context context(1);
    TrimOptions options;
    options.rule = TrimRule::strict;
    const Result<TrimOutput> strict = trim(octree, domain, options, context);
    REQUIRE(strict);
    CHECK(strict->report.kept_cells == 0);
    for (const double limit : {-0.1, 1.5}) {
        options.thinnest_wall_h = limit;
        const Result<TrimOutput> refused = trim(octree, domain, options, context);
        REQUIRE_FALSE(refused);
        CHECK(refused.error().code == ErrorCode::usage);
    }
}

TEST_CASE("parts of walls that mending takes much of are dropped whole") {
    const Domain domain = make_plate(0.5, glm::dmat3(1));
    const HexMesh octree = make_cells(domain, 0.37);
    Context context(1);
    const SurfaceQueries queries(domain.model);
    const trimming::CellGraph graph = trimming::build_cell_graph(octree, context.parallel());
    TrimMemory memory;
    std::vector<Index> keys(octree.cell_count());
    for (Index c = 0; c < keys.size(); ++c) keys[c] = c;
    memory.set_keys(keys);
    const trimming::CellSides sides = trimming::find_sides(octree, graph, queries, context, memory);
    TrimReport report;
    trimming::KeptCells kept(octree, graph, sides, queries, context, report);
    TrimOptions options;
    options.depth_h = 0.5; // none of them
    kept.choose(options);
    const trimming::Coverage bare = trimming::measure_coverage(
        octree, graph, sides, kept, queries, memory.keys(), context.parallel(), memory.surface());
    auto walls =
        trimming::find_wall_cells(octree, graph, sides, kept, queries, bare.spots, 0.25, context.parallel());
    REQUIRE(walls.size() > 100);
    for (const trimming::WallCell& wall : walls) {
        CHECK(wall.thickness == Approx(0.5));
        CHECK(std::abs(wall.middle.z) < 1e-9);
        kept.keep_wall(wall.cell, wall.middle);
    }
    auto whole = walls;
    CHECK(trimming::drop_frayed_walls(graph, kept, whole) == 0);
    CHECK(whole.size() == walls.size());
    for (std::size_t i = 0; i < walls.size(); i += 3) kept.remove(walls[i].cell);
    CHECK(trimming::drop_frayed_walls(graph, kept, whole) == walls.size());
    CHECK(whole.empty());
}

TEST_CASE("layers one cell thick are refined whole where a front between levels would move through them") {
    // Half as large cells on one side: the middle is in one layer of them, half of that of the larger ones.
    const Domain domain = make_plate(0.26, glm::dmat3(1));
    SurfaceOctree octree = octree_round(surface_box(domain.model), 16, 0.92);
    const auto make = [&] { return octree.make(1, [](const Point& at, double, int) { return at.x < 0; }); };
    HexMesh mesh = make();
    const TrimOutput front = trim_with(mesh, domain, 0.25);
    REQUIRE(front.report.half_faces > 5);
    TrimOutput trimmed = trim_with(mesh, domain, 0.25, true);
    REQUIRE(trimmed.refine_cells.size() > 4 * front.refine_cells.size());
    int rounds = 1;
    for (; !trimmed.refine_cells.empty() && rounds < 10; ++rounds) {
        octree.ask(mesh, trimmed.refine_cells);
        mesh = make();
        trimmed = trim_with(mesh, domain, 0.25, true);
    }
    CHECK(rounds <= 3);
    CHECK(trimmed.report.closed_manifold());
    CHECK(trimmed.report.bare_area < 0.1 * trimmed.report.surface_area);

    // A thick body gets what was asked for alone.
    const Domain slab = make_plate(4.3, glm::dmat3(1));
    octree = octree_round(surface_box(slab.model), 16, 0.92);
    mesh = make();
    CHECK(trim_with(mesh, slab, 0.25, true).refine_cells == trim_with(mesh, slab, 0.25).refine_cells);
}

TEST_CASE("bare places are the same where the surface in the cells is known from before") {
    Random random(7);
    const Domain domain = make_plate(0.3, random_rotation(random));
    const HexMesh octree = make_cells(domain, 0.37);
    std::vector<Index> keys(octree.cell_count());
    for (Index c = 0; c < keys.size(); ++c) keys[c] = 3 * c + 2;
    TrimMemory memory;
    Context context(1);
    TrimOptions options;
    for (const bool forgets : {false, true})
        for (const double thinnest_wall_h : {0.0, 0.25}) {
            options.thinnest_wall_h = thinnest_wall_h;
            const auto plain = trim(octree, domain, options, context);
            memory.set_keys(keys);
            const auto again = trim(octree, domain, options, context, nullptr, &memory);
            REQUIRE(plain);
            REQUIRE(again);
            CHECK(again->kept_cell == plain->kept_cell);
            CHECK(again->report.surface_area == plain->report.surface_area);
            CHECK(again->report.bare_area == plain->report.bare_area);
            REQUIRE(again->bare_spots.size() == plain->bare_spots.size());
            if (thinnest_wall_h == 0) REQUIRE_FALSE(again->bare_spots.empty());
            for (std::size_t i = 0; i < plain->bare_spots.size(); ++i) {
                const BareSpot &a = again->bare_spots[i], &b = plain->bare_spots[i];
                CHECK(a.at == b.at);
                CHECK(std::tie(a.cell, a.patch, a.area, a.thickness, a.part) ==
                      std::tie(b.cell, b.patch, b.area, b.thickness, b.part));
            }
            for (const BareSpot& spot : plain->bare_spots) CHECK(memory.surface().knows(keys[spot.cell]));
            if (forgets) memory.forget_surface();
        }
}
