#include "domain/outline_regions.hpp"
#include "domain/outline_solid.hpp"
#include "domain/outline_touching.hpp"
#include "samples/geometry/airfoil.hpp"
#include "stages/planar/planar.hpp"
#include "stages/refine/refine.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

using namespace hexopt;

namespace {

Outline outline_of(std::vector<std::vector<Point2>> loops) {
    Outline outline;
    for (auto& points : loops) {
        OutlineLoop loop;
        loop.points = std::move(points);
        loop.patch.assign(loop.points.size(), static_cast<Index>(outline.loops.size()));
        outline.patch_names.push_back("loop" + std::to_string(outline.loops.size()));
        outline.loops.push_back(std::move(loop));
    }
    REQUIRE(check_touching(outline));
    RegionReport report;
    auto chosen = choose_regions(std::move(outline), {}, report);
    REQUIRE(chosen);
    return std::move(*chosen);
}

std::vector<Point2> turned(std::vector<Point2> points, double degrees, Point2 shift = Point2(0)) {
    const double a = degrees * std::numbers::pi / 180, c = std::cos(a), s = std::sin(a);
    for (Point2& p : points) p = shift + Point2(c * p.x - s * p.y, s * p.x + c * p.y);
    return points;
}

std::vector<Point2> circle(double radius, int n) {
    std::vector<Point2> points;
    for (int i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * i / n;
        points.emplace_back(radius * std::cos(a), radius * std::sin(a));
    }
    return points;
}

struct Made {
    QuadMesh mesh;
    RelaxReport relax;
    WallRowReport row;
};

Made mesh_outline(const Outline& outline, double cells, int threads = 1) {
    Context context(threads);
    const auto solid = make_solid({outline});
    REQUIRE(solid);
    const auto domain = build_domain(*solid, {}, context);
    REQUIRE(domain);
    RefineOptions refining;
    refining.planar = true;
    refining.target_cells = cells;
    auto refined = refine(*domain, refining, context);
    REQUIRE(refined);
    const OutlineCurves curves(outline, 30);
    for (int round = 0; round < 30; ++round) {
        auto fitted = fit_outline(refined->octree, curves, {}, context);
        INFO((fitted ? "" : fitted.error().one_line()));
        REQUIRE(fitted);
        if (!fitted->refine_cells.empty()) {
            REQUIRE(refine_cells(*refined, fitted->refine_cells, context).requested > 0);
            continue;
        }
        Made made{std::move(fitted->mesh), {}, fitted->row};
        auto relaxed = relax_quads(made.mesh, curves, {}, context);
        REQUIRE(relaxed);
        made.relax = *relaxed;
        return made;
    }
    FAIL("refinement does not end");
    return {};
}

double area_of(const QuadMesh& mesh) {
    double twice = 0;
    for (const Quad& q : mesh.quads) {
        const std::array points = {mesh.positions[q[0]], mesh.positions[q[1]], mesh.positions[q[2]],
                                   mesh.positions[q[3]]};
        twice += twice_area(points);
    }
    return twice / 2;
}

double enclosed_by_wall(const QuadMesh& mesh) {
    double twice = 0;
    for (const QuadMesh::WallEdge& e : mesh.wall) {
        const Point2 &a = mesh.positions[e.a], &b = mesh.positions[e.b];
        twice += a.x * b.y - a.y * b.x;
    }
    return twice / 2;
}

/// Bound vertices lie on the outline, every corner has a vertex, hanging ones are where they belong, the
/// wall's polygon encloses what the quads cover.
void check_sound(const Made& made, const Outline& outline) {
    const QuadMesh& mesh = made.mesh;
    const OutlineCurves curves(outline, 30);
    std::size_t corners = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        if (mesh.place[v].loop == kNoIndex) continue;
        REQUIRE(curves.tree().nearest(mesh.positions[v]).distance <= 1e-12 * curves.diagonal());
        corners += mesh.place[v].is_corner;
    }
    CHECK(corners == curves.corner_count());
    for (Index l = 0; l < curves.loop_count(); ++l)
        for (const OutlineCorner& corner : curves.corners(l))
            CHECK(std::count(mesh.positions.begin(), mesh.positions.end(), corner.point) == 1);
    for (std::size_t r = 0; r < mesh.hanging.count(); ++r) {
        REQUIRE(mesh.hanging.offset[r + 1] - mesh.hanging.offset[r] == 2);
        const Point2 middle = 0.5 * mesh.positions[mesh.hanging.master[2 * r]] +
                              0.5 * mesh.positions[mesh.hanging.master[2 * r + 1]];
        REQUIRE(mesh.positions[mesh.hanging.vertex[r]] == middle);
        REQUIRE(mesh.place[mesh.hanging.vertex[r]].loop == kNoIndex);
    }
    CHECK(area_of(mesh) == Approx(enclosed_by_wall(mesh)).epsilon(1e-10));
    CHECK(made.relax.after.inverted == 0);
}

} // namespace

TEST_CASE("the number of cells at a corner makes their angles nearest to right ones") {
    for (double angle = 5; angle < 360; angle += 1) {
        const int cells = cells_at_corner(angle);
        const auto sine = [angle](int n) { return std::sin(angle / n * std::numbers::pi / 180); };
        // At the limits between two numbers their sines are equal to within a degree's change.
        for (int other = 1; other <= 4; ++other)
            if (angle / other < 180) CHECK(sine(cells) > sine(other) - 0.02);
    }
}

TEST_CASE("a turned square is filled exactly, with one cell at each corner") {
    const Outline outline = outline_of({turned({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 31)});
    const Made made = mesh_outline(outline, 1500);
    check_sound(made, outline);
    CHECK(area_of(made.mesh) == Approx(1).epsilon(1e-12));
    CHECK(made.row.corners == std::array<std::size_t, 5>{0, 4, 0, 0, 0});
    CHECK(made.relax.after.smallest > 0.7);
}

TEST_CASE("sections with holes, slits and narrow gaps have no bad quads") {
    std::vector<Point2> slit = {{0, 0}, {2, 0}, {2, 0.99}, {0.7, 1}, {2, 1.01}, {2, 2}, {0, 2}};
    for (const auto& [name, outline] : std::vector<std::pair<std::string, Outline>>{
             {"annulus", outline_of({circle(1, 90), circle(0.9, 90)})},
             {"tiny hole", outline_of({circle(1, 120), turned(circle(0.01, 40), 0, {0.3, 0.2})})},
             {"slit", outline_of({turned(slit, 7)})},
             {"two parts", outline_of({circle(1, 60), turned(circle(0.4, 60), 0, {1.45, 0})})},
         }) {
        INFO(name);
        const Made made = mesh_outline(outline, 1500);
        check_sound(made, outline);
        CHECK(made.relax.after.smallest > 0.5);
    }
}

TEST_CASE("four cells fan round a sharp trailing edge, three at each corner of a blunt one") {
    Context context(1);
    auto section = geometry::make_naca("2412", 60);
    REQUIRE(section);
    const std::vector<Point2> box = {{-2, -2}, {3, -2}, {3, 2}, {-2, 2}};
    const Outline sharp = outline_of({box, *section});
    const Made fan = mesh_outline(sharp, 3000);
    check_sound(fan, sharp);
    CHECK(fan.row.corners == std::array<std::size_t, 5>{0, 4, 0, 0, 1});
    CHECK(fan.relax.after.smallest > 0.6);
    std::vector<Point2> cut;
    for (const Point2& p : *section)
        if (p.x < 0.97) cut.push_back(p);
    const Outline blunt = outline_of({box, turned(cut, 12)});
    const Made base = mesh_outline(blunt, 3000);
    check_sound(base, blunt);
    CHECK(base.row.corners == std::array<std::size_t, 5>{0, 4, 0, 2, 0});
    CHECK(base.relax.after.smallest > 0.6);
}

TEST_CASE("planar meshes are the same bits for any number of threads") {
    const Outline outline = outline_of({circle(1, 100), turned({{0, 0}, {0.5, 0}, {0.1, 0.3}}, 20)});
    const Made one = mesh_outline(outline, 2000, 1), three = mesh_outline(outline, 2000, 3);
    CHECK(one.mesh.positions == three.mesh.positions);
    CHECK(one.mesh.quads == three.mesh.quads);
}

TEST_CASE("extruded vertices lie above each other bit for bit") {
    const Outline outline = outline_of({circle(1, 70)});
    const Made made = mesh_outline(outline, 800);
    const HexMesh mesh = extrude(made.mesh, {-0.3, 0.1, outline.patch_names, "back", "front"});
    const std::size_t n = made.mesh.positions.size();
    REQUIRE(mesh.positions.size() == 2 * n);
    for (std::size_t v = 0; v < n; ++v) {
        REQUIRE(mesh.positions[v] == Point(made.mesh.positions[v], -0.3));
        REQUIRE(mesh.positions[v + n] == Point(made.mesh.positions[v], 0.1));
    }
}

TEST_CASE("a slab is recognised from its surface, and other shapes are not") {
    const Outline outline = outline_of({turned(circle(2, 50), 3), turned(circle(0.5, 20), 0, {0.7, 0.2})});
    const auto solid = make_solid({outline, 0.25, 0.5, "back", "front"});
    REQUIRE(solid);
    const auto slab = recognise_slab(*solid);
    INFO((slab ? "" : slab.error().one_line()));
    REQUIRE(slab);
    CHECK(slab->low == 0.25);
    CHECK(slab->high == 0.5);
    CHECK(slab->low_name == "back");
    CHECK(slab->high_name == "front");
    REQUIRE(slab->outline.loops.size() == 2);
    double twice = 0, wanted = 0;
    for (const OutlineLoop& loop : slab->outline.loops) twice += twice_area(loop.points);
    for (const OutlineLoop& loop : outline.loops) wanted += twice_area(loop.points);
    CHECK(twice == Approx(wanted)); // holes count against: the region lies on the left
    CHECK(slab->outline.patch_names[slab->outline.loops[1].patch[0]] == "loop1");

    TriangleSoup bent = *solid;
    bent.vertices[3].z += 0.1;
    CHECK(recognise_slab(bent).error().code == ErrorCode::bad_input);
    TriangleSoup slanted = *solid;
    for (Point& p : slanted.vertices) p.x += p.z;
    CHECK_FALSE(recognise_slab(slanted));
    TriangleSoup open = *solid;
    open.triangles.erase(open.triangles.begin());
    open.patch.erase(open.patch.begin());
    CHECK_FALSE(recognise_slab(open));
}
