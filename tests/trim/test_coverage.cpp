// How much of a surface trimming says has cells near it.
#include "refine/surfaces.hpp"
#include "stages/trim/trim.hpp"
#include "trim/surface_octree.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

Domain box_domain(const Point& low, const Point& high) {
    TriangleSoup soup;
    test::append_box(soup, low, high);
    return test::make_domain(soup);
}

/// Cells of `size`, whose planes lie at offset * size from the box's low corner.
TrimOutput trim_box(const Domain& domain, double size, double offset) {
    const Box box = surface_box(domain.model);
    const Point extent = box.high - box.low;
    const double longest = std::max({extent.x, extent.y, extent.z});
    SurfaceOctree octree = octree_round(box, static_cast<std::uint32_t>(std::lround(longest / size)), offset);
    const HexMesh mesh = octree.make(0, [](const Point&, double, int) { return false; });
    Context context(1);
    Result<TrimOutput> out = trim(mesh, domain, {}, context);
    if (!out) FAIL(out.error().one_line());
    return std::move(out).value();
}

} // namespace

TEST_CASE("a thick box is covered, wherever the cells lie, and its area is known") {
    const Domain domain = box_domain({0, 0, 0}, {8, 6, 4});
    for (const double offset : {0.05, 0.2, 0.37, 0.5, 0.63, 0.9}) {
        CAPTURE(offset);
        const TrimOutput out = trim_box(domain, 1, offset);
        CHECK(out.report.surface_area == Approx(2 * (48 + 24 + 32)).epsilon(1e-9));
        CHECK(out.report.bare_area == 0);
        CHECK(out.bare_spots.empty());
    }
}

TEST_CASE("a thin wall beside a block is bare where no cells are kept, and its thickness is told") {
    TriangleSoup soup;
    test::append_box(soup, {0, 0, 0}, {6, 6, 6});
    test::append_box(soup, {10, 0, 0}, {10.2, 6, 6}); // within one layer of cells, off their centres
    const Domain domain = test::make_domain(soup);
    const TrimOutput out = trim_box(domain, 1.02, 0.37);
    CHECK(out.report.bare_area == Approx(2 * 36 + 4 * 6 * 0.2).epsilon(1e-6));
    CHECK(out.report.first_bare.x >= 10);
    REQUIRE_FALSE(out.bare_spots.empty());
    double area = 0;
    for (const BareSpot& spot : out.bare_spots) {
        area += spot.area;
        CHECK(spot.at.x >= 10);
        CHECK(spot.at.x <= 10.2);
        CHECK(spot.thickness == Approx(0.2));
        CHECK(domain.names[domain.patch_name[spot.patch]].ends_with("_inner"));
    }
    CHECK(area == Approx(out.report.bare_area));
}

TEST_CASE("bare spots are joined to parts, which know how far they go on from the kept cells") {
    TriangleSoup soup;
    test::append_box(soup, {0, 0, 0}, {6, 6, 6});
    test::append_box(soup, {5, 0, 3.02}, {11.1, 6, 3.22}); // from the block
    test::append_box(soup, {0, 0, 10}, {6, 1, 10.2});      // on its own
    const Domain domain = test::make_domain(soup);
    const TrimOutput out = trim_box(domain, 1.02, 0.37);
    REQUIRE(out.bare_parts.size() == 2);
    std::array<double, 2> area = {0, 0};
    for (const BareSpot& spot : out.bare_spots) {
        REQUIRE(spot.part < 2);
        CHECK((spot.at.z > 7) == (out.bare_spots.back().part == spot.part));
        area[spot.part] += spot.area;
    }
    for (const std::size_t part : {0, 1}) CHECK(out.bare_parts[part].area == Approx(area[part]));
    CHECK(area[0] + area[1] == Approx(out.report.bare_area));
    const Index alone = out.bare_spots.back().part;
    CHECK(out.bare_parts[alone].depth == 6); // seven cells in a row
    CHECK(out.bare_parts[1 - alone].depth == 5);
}

TEST_CASE("with seeds only a part of the surface is wanted: nothing counts as bare") {
    TriangleSoup soup;
    test::append_box(soup, {0, 0, 0}, {6, 6, 6});
    test::append_box(soup, {10, 0, 0}, {10.2, 6, 6});
    const Domain domain = test::make_domain(soup);
    SurfaceOctree octree = octree_round(surface_box(domain.model), 10);
    const HexMesh mesh = octree.make(0, [](const Point&, double, int) { return false; });
    TrimOptions options;
    options.seeds = {Point(3, 3, 3)};
    Context context(1);
    const auto out = trim(mesh, domain, options, context);
    REQUIRE(out.has_value());
    CHECK(out->report.surface_area == 0);
    CHECK(out->bare_spots.empty());
}

TEST_CASE("cells whose centres lie on the surface go, all of them") {
    const Domain domain = box_domain({0, 0, 0}, {6, 6, 6});
    SurfaceOctree octree = octree_round(surface_box(domain.model), 6, 0.5);
    octree.low += Point(1e-16, 3e-16, -2e-16);
    const HexMesh mesh = octree.make(0, [](const Point&, double, int) { return false; });
    Context context(1);
    const auto out = trim(mesh, domain, {}, context);
    REQUIRE(out.has_value());
    CHECK(out->report.kept_cells == 5 * 5 * 5);
    CHECK(out->report.manifold_removed == 0);
    CHECK(out->report.bare_area == 0);
}

TEST_CASE("trimming that remembers cells gives the same as trimming anew") {
    TriangleSoup soup = test::make_sphere(3, 12);
    soup.triangles.resize(soup.triangles.size() - 9); // a hole: sides are asked cell by cell
    soup.patch.resize(soup.triangles.size());
    const Domain domain = test::make_domain(soup);
    SurfaceOctree octree = octree_round(surface_box(domain.model), 12);
    const auto near = [&](const Point& p, double edge, int) { return domain.model.distance(p) < edge; };
    TrimMemory memory;
    Context context(2);
    for (int round = 0; round < 2; ++round) {
        const HexMesh mesh = octree.make(1, near);
        std::vector<Index> keys(mesh.cell_count());
        for (Index c = 0; c < keys.size(); ++c) keys[c] = 2 * c + 1;
        memory.set_keys(keys);
        const auto plain = trim(mesh, domain, {}, context),
                   again = trim(mesh, domain, {}, context, nullptr, &memory);
        REQUIRE(plain);
        REQUIRE(again);
        CHECK(plain->kept_cell == again->kept_cell);
        CHECK(plain->refine_cells == again->refine_cells);
        CHECK(plain->report.cut_cells == again->report.cut_cells);
        CHECK(plain->report.bare_area == again->report.bare_area);
    }
    CHECK(memory.side(0).known);
}
