#include "domain/outline_solid.hpp"
#include "samples/geometry/solid.hpp"
#include "support/turned.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <set>

using namespace hexopt;

namespace {

std::vector<Point2> ring(double radius, int n, Point2 centre = Point2(0)) {
    std::vector<Point2> points;
    for (int i = 0; i < n; ++i) {
        const double a = 2 * 3.14159265358979 * i / n;
        points.push_back(centre + radius * Point2(std::cos(a), std::sin(a)));
    }
    return points;
}

/// A plate of 4 x 3 with a round hole.
TriangleSoup plate(double thickness) {
    Slab slab;
    slab.low = 0.25;
    slab.high = 0.25 + thickness;
    slab.outline.patch_names = {"rim", "hole"};
    for (std::vector<Point2> points :
         {std::vector<Point2>{{-2, -1}, {2, -1}, {2, 2}, {-2, 2}}, ring(0.5, 40, {0.7, 0.3})}) {
        OutlineLoop loop;
        loop.patch.assign(points.size(), static_cast<Index>(slab.outline.loops.size()));
        loop.points = std::move(points);
        slab.outline.loops.push_back(std::move(loop));
    }
    std::reverse(slab.outline.loops[1].points.begin(), slab.outline.loops[1].points.end());
    const auto solid = make_solid(slab);
    REQUIRE(solid);
    return *solid;
}

double area_of(const Outline& outline) {
    double twice = 0;
    for (const OutlineLoop& loop : outline.loops) twice += twice_area(loop.points);
    return twice / 2;
}

const std::vector<Point> kTurns = {
    {0, 37, 0}, {90, 0, 45}, {12, -65, 130}, {1e-3, 0, 0}, {45, 35.2643896828, 0}, {179, 3, 271}};

} // namespace

TEST_CASE("a slab across x or y is recognised with the bits of its coordinates") {
    const TriangleSoup solid = plate(0.1);
    const auto flat = recognise_slab(solid);
    REQUIRE(flat);
    for (int axis : {0, 1}) {
        const auto slab = recognise_slab(test::permuted(solid, axis));
        INFO((slab ? "" : slab.error().one_line()));
        REQUIRE(slab);
        CHECK(slab->outline.frame.axis() == axis);
        CHECK(slab->given.empty());
        CHECK(slab->low == flat->low);
        CHECK(slab->high == flat->high);
        for (std::size_t l = 0; l < 2; ++l)
            CHECK(slab->outline.loops[l].points == flat->outline.loops[l].points);
        std::vector<Point> positions = {{1, 2, slab->low}, {1, 2, slab->high}};
        place_in_model(*slab, positions);
        CHECK(positions[1][axis] == slab->high);
        CHECK(positions[1][(axis + 1) % 3] == 1);
        CHECK(positions[1][(axis + 2) % 3] == 2);
    }
}

TEST_CASE("a slab that was turned and rounded to floats is recognised") {
    const TriangleSoup solid = plate(0.1);
    for (const Point& degrees : kTurns) {
        INFO(describe(degrees));
        const TriangleSoup turned = test::rounded(test::turned(solid, degrees, {3, -1, 2}));
        REQUIRE(find_slab_planes(turned, kThinSlab_rel).size() == 1);
        const auto slab = recognise_slab(turned, kThinSlab_rel);
        INFO((slab ? "" : slab.error().one_line()));
        REQUIRE(slab);
        REQUIRE_FALSE(slab->outline.frame.axis());
        CHECK(slab->high - slab->low == Approx(0.1).margin(1e-6));
        CHECK(area_of(slab->outline) == Approx(area_of(recognise_slab(solid)->outline)).epsilon(1e-6));
        CHECK(slab->outline.loops.size() == 2);
        CHECK(slab->outline.patch_names == solid.patch_names);
        CHECK(std::set<std::string>{slab->low_name, slab->high_name} ==
              std::set<std::string>{"back", "front"});
        // The plate's straight sides lie along the frame's axes to rounding.
        const auto& outer =
            slab->outline.loops[0].points.size() == 4 ? slab->outline.loops[0] : slab->outline.loops[1];
        for (std::size_t i = 0; i < 4; ++i) {
            const Point2 edge = outer.points[(i + 1) % 4] - outer.points[i];
            CHECK(std::min(std::abs(edge.x), std::abs(edge.y)) < 2e-6);
        }
        // Points of the outline go back to the input's vertices, all others into the planes.
        const std::size_t count = outer.points.size() + 1;
        std::vector<Point> positions;
        for (double height : {slab->low, slab->high}) {
            for (const Point2& p : outer.points) positions.emplace_back(p, height);
            positions.emplace_back(0.5 * (outer.points[0] + outer.points[1]), height);
        }
        place_in_model(*slab, positions);
        for (std::size_t v = 0; v < positions.size(); ++v) {
            const bool is_given = std::find(turned.vertices.begin(), turned.vertices.end(), positions[v]) !=
                                  turned.vertices.end();
            CHECK(is_given == (v % count != count - 1));
            const double height = v < count ? slab->low : slab->high;
            CHECK(glm::dot(slab->outline.frame.normal(), positions[v]) ==
                  Approx(height).margin(is_given ? 5e-6 : 1e-14));
        }
    }
}

TEST_CASE("of several pairs of planes thin ones come first, then those along the axes") {
    const TriangleSoup box =
        geometry::make_box(Point(0), Point(1, 0.02, 0.5), {"a", "b", "c", "d", "e", "f"});
    const auto planes = find_slab_planes(box);
    REQUIRE(planes.size() == 3);
    CHECK(planes[0].frame.axis() == 1);
    CHECK(planes[1].frame.axis() == 2);
    CHECK(find_slab_planes(box, kThinSlab_rel).size() == 1);
    // A turned cube has no main axes, but faces.
    const TriangleSoup cube = geometry::make_box(Point(0), Point(1), {"a", "b", "c", "d", "e", "f"});
    const TriangleSoup turned = test::rounded(test::turned(cube, {20, 30, 40}, Point(0)));
    CHECK_FALSE(find_slab_planes(turned).empty());
    CHECK(recognise_slab(turned));
    CHECK(find_slab_planes(turned, kThinSlab_rel).empty());
}

TEST_CASE("what is nearly a slab is none") {
    const TriangleSoup solid = plate(0.1); // diagonal 5
    for (const Point& degrees : {Point(0), Point(0, 37, 0), Point(12, -65, 130)}) {
        INFO(describe(degrees));
        const auto is_slab = [&](const TriangleSoup& soup) {
            return recognise_slab(test::rounded(test::turned(soup, degrees, Point(0)))).has_value();
        };
        CHECK(is_slab(solid));
        TriangleSoup lifted = solid; // one vertex off its plane
        lifted.vertices[7].z += 2e-6;
        CHECK(is_slab(lifted));
        lifted.vertices[7].z += 2e-4;
        CHECK_FALSE(is_slab(lifted));
        TriangleSoup shifted = solid; // one vertex off the one below it
        shifted.vertices[50].x += 1e-4;
        CHECK_FALSE(is_slab(shifted));
        TriangleSoup tapered = solid; // equal outlines but for their size
        for (Point& p : tapered.vertices)
            if (p.z > 0.3) p *= Point(1.001, 1.001, 1);
        CHECK_FALSE(is_slab(tapered));
        CHECK_FALSE(find_slab_planes(tapered).empty());
        TriangleSoup slanted = solid;
        for (Point& p : slanted.vertices) p.x += p.z;
        CHECK_FALSE(is_slab(slanted));
        TriangleSoup wedge = solid; // its planes are not parallel
        for (Point& p : wedge.vertices)
            if (p.z > 0.3) p.z += 1e-3 * p.x;
        CHECK_FALSE(is_slab(wedge));
        TriangleSoup bent = solid;
        for (Point& p : bent.vertices) p.z += 1e-3 * p.x * p.x;
        CHECK_FALSE(is_slab(bent));
        TriangleSoup open = solid;
        open.triangles.erase(open.triangles.begin());
        open.patch.erase(open.patch.begin());
        CHECK_FALSE(is_slab(open));
        TriangleSoup two = solid; // side by side, one thicker
        for (const Point& p : solid.vertices) two.vertices.emplace_back(p.x + 9, p.y, p.z > 0.3 ? 0.4 : p.z);
        const auto count = static_cast<Index>(solid.vertices.size());
        for (const auto& t : solid.triangles)
            two.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
        two.patch.insert(two.patch.end(), solid.patch.begin(), solid.patch.end());
        CHECK_FALSE(is_slab(two));
    }
    CHECK(find_slab_planes({}).empty());
    TriangleSoup sheet = solid;
    for (Point& p : sheet.vertices) p.z = 0;
    CHECK(find_slab_planes(sheet).empty());
    CHECK(find_slab_planes(test::turned(sheet, {20, 30, 40}, Point(0))).empty());
    TriangleSoup needle; // all on a line
    needle.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    needle.triangles = {{0, 1, 2}};
    CHECK(find_slab_planes(needle).empty());
}
