#include "cad_samples.hpp"
#include "core/digest.hpp"
#include "io/project_on_cad.hpp"
#include "scratch.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <map>

using namespace hexopt;
using namespace hexopt::test;

namespace {

constexpr double kMatch_rel = 1e-4;

struct Projected {
    CadSurface surface;
    std::vector<CadQuery> queries;
    std::vector<std::optional<CadPoint>> points;
};

/// Centres of all triangles and middles of their edges between patches, projected.
Projected project(const std::string& bytes, const std::string& name) {
    const Scratch scratch;
    spill(scratch / name, bytes);
    Context context(1);
    const TessellationOptions coarse{1e-2, 30};
    Projected out;
    auto surface = read_cad(scratch / name, coarse, context);
    REQUIRE(surface);
    out.surface = std::move(*surface);
    const TriangleSoup& soup = out.surface.soup;
    std::map<std::array<Index, 2>, std::vector<Index>> sides;
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
        const auto& v = soup.triangles[t];
        out.queries.push_back({(soup.vertices[v[0]] + soup.vertices[v[1]] + soup.vertices[v[2]]) / 3.0, 2});
        for (std::size_t k = 0; k < 3; ++k)
            sides[{std::min(v[k], v[(k + 1) % 3]), std::max(v[k], v[(k + 1) % 3])}].push_back(soup.patch[t]);
    }
    for (const auto& [edge, patches] : sides)
        if (patches.size() == 2 && patches[0] != patches[1])
            out.queries.push_back({0.5 * (soup.vertices[edge[0]] + soup.vertices[edge[1]]), 1});
    auto points =
        project_on_cad(scratch / name, Digest().add(bytes).value(), coarse, kMatch_rel, out.queries, context);
    if (!points) FAIL(points.error().one_line());
    out.points = std::move(*points);
    return out;
}

/// All queries have exact points, nowhere farther from the exact surface than rounding.
void check_exact(const Projected& projected, const std::function<double(const Point&)>& off_face,
                 const std::function<double(const Point&)>& off_edge, double tolerance = 1e-9) {
    double before = 0, after = 0;
    std::size_t edges = 0;
    for (std::size_t i = 0; i < projected.queries.size(); ++i) {
        const CadQuery& query = projected.queries[i];
        const auto& off = query.dimension == 2 ? off_face : off_edge;
        edges += query.dimension == 1;
        REQUIRE(projected.points[i]);
        CHECK(projected.points[i]->match < 1e-9);
        before = std::max(before, off(query.point));
        after = std::max(after, off(projected.points[i]->point));
    }
    CHECK(before > 1e-3);
    CHECK(after < tolerance);
}

} // namespace

TEST_CASE("points on triangles are projected on the exact sphere, cylinder and torus") {
    check_exact(
        project(step_of_sphere(), "a.step"), [](const Point& p) { return std::abs(glm::length(p) - 2); },
        [](const Point&) { return 0.0; });
    const auto off_cylinder = [](const Point& p) {
        const double radius = std::hypot(p.x, p.y);
        return std::min({std::abs(radius - 1), std::abs(p.z), std::abs(p.z - 3)});
    };
    const auto off_circle = [](const Point& p) {
        return std::hypot(std::hypot(p.x, p.y) - 1, std::min(std::abs(p.z), std::abs(p.z - 3)));
    };
    check_exact(project(step_of_cylinder(), "a.step"), off_cylinder, off_circle);
    check_exact(project(iges_of_cylinder(), "a.iges"), off_cylinder, off_circle, 5e-6 /* of its edges */);
    check_exact(
        project(brep_of_torus(), "a.brep"),
        [](const Point& p) { return std::abs(std::hypot(std::hypot(p.x, p.y) - 3, p.z) - 1); },
        [](const Point&) { return 0.0; });
}

TEST_CASE("exact points are the closest ones") {
    // On an extruded B-spline: what is left between a point and its exact one is normal to the surface, so no
    // exact point of a neighbour is nearer.
    const Projected projected = project(brep_of_spline(), "a.brep");
    for (std::size_t i = 0; i < projected.queries.size(); ++i) {
        REQUIRE(projected.points[i]);
        const Point p = projected.queries[i].point;
        const double own = glm::distance(p, projected.points[i]->point);
        for (std::size_t k = 0; k < projected.queries.size(); ++k)
            if (projected.queries[k].dimension >= projected.queries[i].dimension &&
                projected.queries[i].dimension == 2)
                CHECK(own <= glm::distance(p, projected.points[k]->point) + 1e-9);
    }
}

TEST_CASE("vertices are exact, other places have none, and the file must be what it was") {
    const Scratch scratch;
    const std::string bytes = step_of_box();
    spill(scratch / "a.step", bytes);
    Context context(1);
    const std::vector<CadQuery> queries = {{Point(2, 3, 4) + Point(1e-5), 0},
                                           {Point(2, 3, 3), 0},
                                           {Point(2, 3, 3), 1},
                                           {Point(2, 2, 3), 1},
                                           {Point(2, 2, 3), 2},
                                           {Point(9, 9, 9), 2}};
    const std::uint64_t digest = Digest().add(bytes).value();
    const auto points = project_on_cad(scratch / "a.step", digest, {}, kMatch_rel, queries, context);
    REQUIRE(points);
    REQUIRE((*points)[0]);
    CHECK(glm::distance((*points)[0]->point, Point(2, 3, 4)) < 1e-12);
    CHECK((*points)[0]->match == Approx(std::sqrt(3) * 1e-5));
    CHECK(!(*points)[1]);
    REQUIRE((*points)[2]);
    CHECK(glm::distance((*points)[2]->point, Point(2, 3, 3)) < 1e-12);
    CHECK(!(*points)[3]);
    CHECK((*points)[4]);
    CHECK(!(*points)[5]);

    spill(scratch / "a.step", bytes + " ");
    const auto changed = project_on_cad(scratch / "a.step", digest, {}, kMatch_rel, queries, context);
    REQUIRE(!changed);
    CHECK(changed.error().code == ErrorCode::bad_input);
    CHECK(changed.error().one_line().find("has changed") != std::string::npos);
    CHECK(!project_on_cad(scratch / "none.step", digest, {}, kMatch_rel, queries, context));
    const std::string half = bytes.substr(0, bytes.size() / 2);
    spill(scratch / "a.step", half);
    CHECK(!project_on_cad(scratch / "a.step", Digest().add(half).value(), {}, kMatch_rel, queries, context));
    spill(scratch / "a.step", bytes);
    context.cancel();
    const auto cancelled = project_on_cad(scratch / "a.step", digest, {}, kMatch_rel, queries, context);
    REQUIRE(!cancelled);
    CHECK(cancelled.error().code == ErrorCode::cancelled);
}
