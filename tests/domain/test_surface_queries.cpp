// Inside tests against closed forms, also of surfaces with planted defects.
#include "domain/orient_surface.hpp"
#include "domain/surface_queries.hpp"
#include "support/shapes.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <random>

using namespace hexopt;

namespace {

using Depth = std::function<double(const Point&)>; ///< positive inside

struct Shape {
    const char* name;
    TriangleSoup soup;
    Depth depth;
    double blur; ///< how far the triangles are from the shape, and where a defect may decide
};

double box_depth(const Point& p, const Point& half) {
    const Point d = half - glm::abs(p);
    if (d.x > 0 && d.y > 0 && d.z > 0) return std::min({d.x, d.y, d.z});
    return -glm::length(glm::max(-d, Point(0)));
}

std::vector<Shape> make_shapes() {
    const Point half(1, 0.6, 0.3);
    return {
        {"sphere", make_sphere_surface(Point(0), 1), [](const Point& p) { return 1 - glm::length(p); },
         0.006},
        {"box", make_box_surface(-half, half), [half](const Point& p) { return box_depth(p, half); }, 1e-9},
        {"torus", make_torus_surface(1, 0.4),
         [](const Point& p) {
             const double r = std::sqrt(p.x * p.x + p.y * p.y) - 1;
             return 0.4 - std::sqrt(r * r + p.z * p.z);
         },
         0.01}};
}

Domain domain_of(const TriangleSoup& soup, OrientationReport* report = nullptr) {
    Context context(2);
    Result<OrientedSurface> oriented = orient_surface(soup, context);
    if (!oriented) FAIL(oriented.error().one_line());
    if (report) *report = oriented->report;
    Result<Domain> domain = build_domain(oriented->soup, {}, context);
    if (!domain) FAIL(domain.error().one_line());
    return std::move(domain).value();
}

/// Number of points on the wrong side among those farther than `blur` from the surface.
std::size_t count_wrong(const Shape& shape, const TriangleSoup& soup, const glm::dmat3& turn, double blur,
                        Random& random) {
    const Domain domain = domain_of(soup);
    const SurfaceQueries queries(domain.model);
    std::size_t wrong = 0;
    for (int i = 0; i < 4000; ++i) {
        const Point p(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5));
        const double depth = shape.depth(p);
        if (std::abs(depth) > blur) wrong += queries.is_inside(turn * p) != (depth > 0);
    }
    return wrong;
}

void turn_all(TriangleSoup& soup, const glm::dmat3& turn) {
    for (Point& p : soup.vertices) p = turn * p;
}

} // namespace

TEST_CASE("inside and signed depth agree with closed forms in any direction") {
    Random random(7);
    for (const Shape& shape : make_shapes()) {
        INFO(shape.name);
        for (int round = 0; round < 3; ++round) {
            const glm::dmat3 turn = random_rotation(random);
            TriangleSoup soup = shape.soup;
            turn_all(soup, turn);
            CHECK(count_wrong(shape, soup, turn, shape.blur, random) == 0);
            const Domain domain = domain_of(soup);
            const SurfaceQueries queries(domain.model);
            std::vector<Point> points;
            std::vector<double> expected;
            for (int i = 0; i < 500; ++i) {
                const Point p(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5),
                              random.uniform(-1.5, 1.5));
                points.push_back(turn * p);
                expected.push_back(shape.depth(p));
            }
            const std::vector<double> one = queries.signed_depths(points, Parallel(1)),
                                      three = queries.signed_depths(points, Parallel(3));
            CHECK(one == three);
            double worst = 0;
            for (std::size_t i = 0; i < one.size(); ++i)
                worst = std::max(worst, std::abs(one[i] - expected[i]));
            CHECK(worst < 1.1 * shape.blur + 1e-12);
        }
    }
}

TEST_CASE("flipped, doubled, missing, cracked and degenerate triangles do not change sides") {
    Random random(11);
    for (const Shape& shape : make_shapes()) {
        INFO(shape.name);
        const std::size_t count = shape.soup.triangles.size();
        TriangleSoup flipped = shape.soup, inward = shape.soup, doubled = shape.soup, holes = shape.soup,
                     cracked = shape.soup, degenerate = shape.soup;
        for (auto& t : flipped.triangles)
            if (random.uniform() < 0.3) std::swap(t[0], t[1]);
        CHECK(count_wrong(shape, flipped, glm::dmat3(1), shape.blur, random) == 0);
        for (auto& t : inward.triangles) std::swap(t[0], t[1]);
        CHECK(count_wrong(shape, inward, glm::dmat3(1), shape.blur, random) == 0);
        for (std::size_t t = 0; t < count; t += 7) {
            auto copy = doubled.triangles[t];
            if (t % 2) std::swap(copy[0], copy[1]);
            doubled.triangles.push_back(copy);
        }
        CHECK(count_wrong(shape, doubled, glm::dmat3(1), shape.blur, random) == 0);
        holes.triangles.erase(holes.triangles.begin() + static_cast<std::ptrdiff_t>(count / 3));
        holes.triangles.erase(holes.triangles.begin() + static_cast<std::ptrdiff_t>(2 * count / 3));
        CHECK(count_wrong(shape, holes, glm::dmat3(1), 0.3, random) == 0);
        for (Point& p : cracked.vertices)
            if (random.uniform() < 0.15)
                p += 1e-4 * Point(random.uniform(), random.uniform(), random.uniform());
        CHECK(count_wrong(shape, cracked, glm::dmat3(1), shape.blur + 0.005, random) == 0);
        for (std::size_t t = 0; t < count; t += 5) {
            const auto v = degenerate.triangles[t];
            degenerate.triangles.push_back({v[0], v[1], v[1]});
            degenerate.vertices.push_back(0.5 * (degenerate.vertices[v[0]] + degenerate.vertices[v[1]]));
            degenerate.triangles.push_back({v[0], v[1], static_cast<Index>(degenerate.vertices.size() - 1)});
        }
        CHECK(count_wrong(shape, degenerate, glm::dmat3(1), shape.blur + 0.005, random) == 0);
    }
}

TEST_CASE("a body in a box is a cavity however either is oriented, and crossing bodies are a union") {
    for (int turned = 0; turned < 4; ++turned) {
        TriangleSoup outer = make_box_surface(Point(-3), Point(3)),
                     inner = make_sphere_surface(Point(0.3, 0, 0), 1);
        for (auto& t : outer.triangles)
            if (turned & 1) std::swap(t[0], t[1]);
        for (auto& t : inner.triangles)
            if (turned & 2) std::swap(t[0], t[1]);
        append_soup(outer, inner);
        OrientationReport report;
        const Domain domain = domain_of(outer, &report);
        CHECK(report.bodies == 1);
        CHECK(report.cavities == 1);
        const SurfaceQueries queries(domain.model);
        CHECK(queries.is_inside(Point(-2, 1, 1)));
        CHECK_FALSE(queries.is_inside(Point(0.3, 0.1, 0)));
        CHECK_FALSE(queries.is_inside(Point(4, 0, 0)));
        CHECK(queries.crosses_surface(Point(-2, 0, 0), Point(0, 0, 0)));
        CHECK_FALSE(queries.crosses_surface(Point(-2, 2, 2), Point(2, 2, 2)));
        CHECK(queries.leaves_inside(Point(-2, 0, 0), Point(2, 0, 0), 1e-6));
    }
    TriangleSoup pair = make_sphere_surface(Point(-0.5, 0, 0), 1);
    append_soup(pair, make_sphere_surface(Point(0.5, 0, 0), 1));
    OrientationReport report;
    const Domain domain = domain_of(pair, &report);
    CHECK(report.bodies == 2);
    const SurfaceQueries queries(domain.model);
    for (double x : {-1.3, -0.5, 0.0, 0.5, 1.3}) CHECK(queries.is_inside(Point(x, 0.01, 0.02)));
    CHECK_FALSE(queries.leaves_inside(Point(-1.2, 0.01, 0), Point(1.2, 0.01, 0), 1e-6));
    const Point overlapped(0.45, 0.01, 0.02); // inside of one, near the other's surface
    CHECK(queries.is_inside_beyond(overlapped, domain.model.project_patch(kNoIndex, overlapped), 1e-6));
    const Point outer(1.45, 0.01, 0.02);
    CHECK_FALSE(queries.is_inside_beyond(outer, domain.model.project_patch(kNoIndex, outer), 1e-6));
}

TEST_CASE("on a concave edge the inside does not go on behind the surface") {
    // An L, extruded: at its inner edge the normal of each wall runs along the other one.
    TriangleSoup prism;
    const std::array<std::array<double, 2>, 6> outline = {{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}};
    for (double z : {0.0, 3.0})
        for (const auto& [x, y] : outline) prism.vertices.push_back(Point(x, y, z));
    for (Index k = 0; k < 6; ++k) {
        const Index next = (k + 1) % 6;
        prism.triangles.push_back({k, next, next + 6});
        prism.triangles.push_back({k, next + 6, k + 6});
    }
    for (const auto& t : {std::array<Index, 3>{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}) {
        prism.triangles.push_back({t[0], t[2], t[1]});
        prism.triangles.push_back({t[0] + 6, t[1] + 6, t[2] + 6});
    }
    const Domain domain = domain_of(prism);
    const SurfaceQueries queries(domain.model);
    REQUIRE(queries.is_inside(Point(0.5, 0.5, 1)));
    REQUIRE_FALSE(queries.is_inside(Point(1.5, 1.5, 1)));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> along(0.01, 2.99), off(-1e-12, 1e-12);
    for (int k = 0; k < 200; ++k) {
        const Point p(1 + off(random), 1 + off(random), along(random));
        CHECK_FALSE(queries.is_inside_beyond(p, domain.model.project_patch(kNoIndex, p), 1e-4));
    }
}

TEST_CASE("the wall between two solids that touch and fins inside a solid bound nothing") {
    TriangleSoup pair = make_box_surface(Point(0), Point(1));
    append_soup(pair, make_box_surface(Point(1, 0, 0), Point(2, 1, 1)));
    OrientationReport report;
    const Domain joined = domain_of(pair, &report);
    CHECK(report.repeated_triangles == 64);
    CHECK(SurfaceQueries(joined.model).is_inside(Point(1, 0.4, 0.3)));
    CHECK_FALSE(SurfaceQueries(joined.model).leaves_inside(Point(0.5, 0.4, 0.3), Point(1.5, 0.4, 0.3), 1e-6));

    TriangleSoup finned = make_box_surface(Point(0), Point(1));
    add_grid(finned, 2, 2, [](int i, int j) { return Point(0.5, 0.25 * i, 0.25 * j); });
    const Domain solid = domain_of(finned, &report);
    CHECK(report.sheet_triangles == 8);
    const SurfaceQueries queries(solid.model);
    CHECK(queries.is_inside(Point(0.499, 0.25, 0.25)));
    CHECK(queries.is_inside(Point(0.501, 0.25, 0.25)));
}

TEST_CASE("orientation refuses what cannot bound anything") {
    Context context(1);
    TriangleSoup empty;
    CHECK_FALSE(orient_surface(empty, context));
    TriangleSoup wrong = make_box_surface(Point(0), Point(1));
    wrong.triangles[3][1] = 100000;
    CHECK_FALSE(orient_surface(wrong, context));
    wrong = make_box_surface(Point(0), Point(1));
    wrong.vertices[5].x = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(orient_surface(wrong, context));
}
