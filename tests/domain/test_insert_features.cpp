#include "domain/domain.hpp"
#include "domain/insert_features.hpp"
#include "samples/geometry/geometries.hpp"
#include "samples/geometry/solid.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <random>

using namespace hexopt;

namespace {

TriangleSoup cube() {
    return geometry::make_box(Point(0), Point(1), {"west", "east", "south", "north", "down", "up"});
}

FeatureLines lines_of(std::vector<Point> points) {
    FeatureLines lines;
    lines.file = "lines.obj";
    for (std::size_t i = 0; i + 1 < points.size(); ++i) lines.segments.push_back({points[i], points[i + 1]});
    return lines;
}

FeaturedSurface insert(const TriangleSoup& soup, const std::vector<FeatureLines>& lines, double tolerance) {
    Context context(1);
    auto featured = insert_features(soup, lines, tolerance, context);
    INFO((featured ? "" : featured.error().one_line()));
    REQUIRE(featured);
    return std::move(*featured);
}

double area(const TriangleSoup& soup) {
    double sum = 0;
    for (const auto& [a, b, c] : soup.triangles)
        sum += glm::length(
                   glm::cross(soup.vertices[b] - soup.vertices[a], soup.vertices[c] - soup.vertices[a])) /
               2;
    return sum;
}

double length(const FeaturedSurface& surface) {
    double sum = 0;
    for (const auto& [a, b] : surface.edges)
        sum += glm::distance(surface.soup.vertices[a], surface.soup.vertices[b]);
    return sum;
}

/// Every edge has two triangles that run along it in opposite directions, and every feature is an edge.
void check_closed(const FeaturedSurface& surface) {
    std::map<std::array<Index, 2>, int> sides;
    for (const auto& t : surface.soup.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = t[k], b = t[(k + 1) % 3];
            REQUIRE(a != b);
            sides[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : 1000;
        }
    for (const auto& [edge, count] : sides) REQUIRE(count == 1001);
    for (const auto& edge : surface.edges) REQUIRE(sides.contains(edge));
    CHECK(surface.soup.patch.size() == surface.soup.triangles.size());
}

Domain domain_of(const FeaturedSurface& surface, double angle) {
    Context context(1);
    BoundaryOptions options;
    options.feature_angle_deg = angle;
    options.patch_borders = false;
    auto domain = build_domain(surface.soup, options, context, surface.edges);
    REQUIRE(domain);
    return std::move(*domain);
}

} // namespace

TEST_CASE("lines along edges of the surface are those edges, whatever digits they have lost") {
    const TriangleSoup soup = cube();
    FeatureLines lines;
    for (int i = 0; i < 8; ++i)
        for (int axis : {1, 2, 4})
            if (!(i & axis)) {
                const auto corner = [](int k) {
                    return Point(k & 1 ? 1.00001 : 0, k & 2 ? 0.99999 : 0, k & 4 ? 1 : 1e-5);
                };
                lines.segments.push_back({corner(i), corner(i | axis)});
            }
    const FeaturedSurface featured = insert(soup, {lines}, 1e-3);
    CHECK(featured.cut_triangles == 0);
    CHECK(featured.edges.size() == 12);
    CHECK(featured.soup.triangles == soup.triangles);
    const Domain by_lines = domain_of(featured, 180);
    CHECK(by_lines.model.curve_count() == 12);
    CHECK(by_lines.model.corner_count() == 8);
    CHECK(by_lines.model.patch_count() == 6);
    CHECK(domain_of(insert(soup, {}, 1e-3), 180).model.curve_count() == 0);
}

TEST_CASE("one line along several edges, and several along one") {
    Context context(1);
    const auto cylinder = make_geometry("cylinder", {24, ""}, context);
    REQUIRE(cylinder);
    FeaturedSurface featured =
        insert(cube(), {lines_of({Point(0), Point(0.3, 0, 0), Point(0.4, 0, 0), Point(1, 0, 0)})}, 1e-3);
    CHECK(length(featured) == Approx(1));
    check_closed(featured);
    featured = insert(featured.soup, {lines_of({Point(0), Point(1, 0, 0)})}, 1e-3);
    CHECK(featured.cut_triangles == 0);
    CHECK(featured.edges.size() == 3);
}

TEST_CASE("lines across triangles cut them in their planes") {
    const TriangleSoup soup = cube();
    const std::vector<Point> square = {Point(0.2, 0.2, 1), Point(0.8, 0.2, 1), Point(0.8, 0.8, 1),
                                       Point(0.2, 0.8, 1), Point(0.2, 0.2, 1)};
    const std::vector<Point> belt = {Point(0, 0.37, 0), Point(1, 0.37, 0), Point(1, 0.37, 1),
                                     Point(0, 0.37, 1), Point(0, 0.37, 0)};
    const FeaturedSurface featured = insert(soup, {lines_of(square), lines_of(belt)}, 1e-4);
    check_closed(featured);
    CHECK(area(featured.soup) == Approx(6).epsilon(1e-12));
    CHECK(length(featured) == Approx(4 * 0.6 + 4).epsilon(1e-12));
    const Domain domain = domain_of(featured, 180);
    CHECK(domain.model.patch_count() == 4); // the belt halves the cube and the square, which is a patch apart
    for (Index c = 0; c < domain.model.curve_count(); ++c) CHECK(domain.curve_patch[c].size() == 2);
    const Domain sharp = domain_of(featured, 30);
    CHECK(sharp.model.corner_count() == 8 + 4 + 4 + 2);
}

TEST_CASE("random lines on a rough ball become chains of edges near them") {
    TriangleSoup soup = geometry::make_box(Point(-1), Point(1), {"a", "b", "c", "d", "e", "f"});
    Context context(1);
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int round = 0; round < 5; ++round) { // halve all edges, onto the ball
        std::map<std::array<Index, 2>, Index> middle;
        TriangleSoup fine;
        fine.vertices = soup.vertices;
        fine.patch_names = soup.patch_names;
        for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
            const auto v = soup.triangles[t];
            std::array<Index, 3> m{};
            for (std::size_t k = 0; k < 3; ++k) {
                const Index a = v[k], b = v[(k + 1) % 3];
                const auto [entry, is_new] = middle.try_emplace({std::min(a, b), std::max(a, b)},
                                                                static_cast<Index>(fine.vertices.size()));
                if (is_new) fine.vertices.push_back(0.5 * (soup.vertices[a] + soup.vertices[b]));
                m[k] = entry->second;
            }
            for (const auto& part :
                 {std::array{v[0], m[0], m[2]}, {v[1], m[1], m[0]}, {v[2], m[2], m[1]}, m}) {
                fine.triangles.push_back(part);
                fine.patch.push_back(0);
            }
        }
        soup = std::move(fine);
    }
    for (Point& p : soup.vertices) p = glm::normalize(p) * (1 + 0.002 * uniform(random));
    const double before = area(soup);
    const double tolerance = 0.02;
    std::vector<FeatureLines> lines;
    for (int i = 0; i < 20; ++i) {
        Point a = glm::normalize(Point(uniform(random), uniform(random), uniform(random)));
        const Point turn = glm::normalize(Point(uniform(random), uniform(random), uniform(random)));
        std::vector<Point> chain;
        for (int k = 0; k < 30; ++k) {
            chain.push_back(a);
            a = glm::normalize(a + 0.06 * glm::cross(turn, a));
        }
        lines.push_back(lines_of(chain));
    }
    const FeaturedSurface featured = insert(soup, lines, tolerance);
    check_closed(featured);
    CHECK(featured.cut_triangles > 1000);
    CHECK(area(featured.soup) == Approx(before).epsilon(1e-9));
    for (const auto& edge : featured.edges)
        for (Index v : edge) {
            double nearest = 1;
            for (const FeatureLines& chain : lines)
                for (const auto& [a, b] : chain.segments) {
                    const Point d = b - a;
                    const double t =
                        std::clamp(glm::dot(featured.soup.vertices[v] - a, d) / glm::dot(d, d), 0.0, 1.0);
                    nearest = std::min(nearest, glm::distance(featured.soup.vertices[v], a + t * d));
                }
            REQUIRE(nearest <= tolerance * (1 + 1e-9));
        }
    const FeaturedSurface again = insert(soup, lines, tolerance);
    CHECK(again.edges == featured.edges);
    CHECK(again.soup.triangles == featured.soup.triangles);
}

TEST_CASE("lines that leave the surface are refused with file and place") {
    Context context(1);
    for (const auto& points : {std::vector{Point(0.2, 0.2, 1.1), Point(0.8, 0.2, 1)},
                               std::vector{Point(0.2, 0.2, 1), Point(0.3, 0.4, 0)},
                               std::vector{Point(0, 0, 0), Point(0, 0.5, 0), Point(1, 0.5, 1)}}) {
        const auto featured = insert_features(cube(), std::vector{lines_of(points)}, 1e-3, context);
        REQUIRE(!featured);
        INFO(featured.error().one_line());
        CHECK(featured.error().code == ErrorCode::bad_input);
        CHECK(featured.error().one_line().find("lines.obj near (") != std::string::npos);
    }
    Context cancelled(1);
    cancelled.cancel();
    const auto stopped =
        insert_features(cube(), std::vector{lines_of({Point(0), Point(1, 0, 0)})}, 1e-3, cancelled);
    REQUIRE(!stopped);
    CHECK(stopped.error().code == ErrorCode::cancelled);
}
