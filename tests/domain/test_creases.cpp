#include "domain/surface_creases.hpp"

#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

constexpr double kRadian = std::numbers::pi / 180;

/// A strip along y of faces that turn by the given angles (degrees) between one and the next; each face is
/// cut into `rows` by triangles of alternating diagonals.
TriangleSoup make_folded_strip(const std::vector<double>& width, const std::vector<double>& turn_deg,
                               double length, int rows) {
    std::vector<std::array<double, 2>> profile = {{0, 0}};
    double angle = 0;
    for (std::size_t i = 0; i < width.size(); ++i) {
        const auto [x, z] = profile.back();
        profile.push_back({x + width[i] * std::cos(angle), z + width[i] * std::sin(angle)});
        if (i < turn_deg.size()) angle -= turn_deg[i] * kRadian;
    }
    TriangleSoup soup;
    const auto count = static_cast<Index>(profile.size());
    for (int row = 0; row <= rows; ++row)
        for (const auto& [x, z] : profile) soup.vertices.emplace_back(x, length * row / rows, z);
    for (Index row = 0; row < static_cast<Index>(rows); ++row)
        for (Index k = 0; k + 1 < count; ++k) {
            const Index a = row * count + k, b = a + 1, c = b + count, d = a + count;
            if ((row + k) % 2 == 0) {
                soup.triangles.push_back({a, b, c});
                soup.triangles.push_back({a, c, d});
            } else {
                soup.triangles.push_back({a, b, d});
                soup.triangles.push_back({b, c, d});
            }
        }
    return soup;
}

std::vector<Crease> creases_of(const TriangleSoup& soup, double least_turn, double farthest) {
    const auto clean = clean_surface(soup);
    REQUIRE(clean);
    return find_creases(clean->vertices, clean->triangles, clean->polygons.normal, least_turn, farthest);
}

/// Largest distance between a chord of length `size` and a profile of two faces, by trying all places.
double brute_force_distance(double a, double b, double turn, double size) {
    double largest = 0;
    for (int i = 0; i <= 400; ++i) {
        const double left = std::min(a, size * i / 400.0), right = std::min(b, size - size * i / 400.0);
        const double chord = std::sqrt(left * left + right * right + 2 * left * right * std::cos(turn));
        if (chord > 0) largest = std::max(largest, left * right * std::sin(turn) / chord);
    }
    return largest;
}

} // namespace

TEST_CASE("the width beside a crease is that of the flat face, however it is cut into triangles") {
    for (int rows : {1, 3, 8}) {
        const auto creases = creases_of(make_folded_strip({2, 0.5, 3}, {20, 12}, 4, rows), 1 * kRadian, 10);
        REQUIRE(creases.size() == std::size_t(2 * rows));
        for (const Crease& crease : creases) {
            const bool first = std::abs(crease.turn - 20 * kRadian) < 1e-9;
            CHECK((first || std::abs(crease.turn - 12 * kRadian) < 1e-9));
            const auto [narrow, wide] = std::minmax(crease.width[0], crease.width[1]);
            CHECK(narrow == Approx(0.5));
            CHECK(wide == Approx(first ? 2 : 3));
        }
    }
}

TEST_CASE("widths end where they are asked to, and go on over slight bends") {
    for (const Crease& crease :
         creases_of(make_folded_strip({2, 1, 1.5}, {25, 5}, 4, 2), 20 * kRadian, 1.2)) {
        CHECK(crease.width[0] == Approx(1.2));
        CHECK(crease.width[1] == Approx(1.2));
    }
    for (const Crease& crease : creases_of(make_folded_strip({2, 1, 1.5}, {25, 5}, 4, 2), 20 * kRadian, 9)) {
        CHECK(std::min(crease.width[0], crease.width[1]) == Approx(2));
        CHECK(std::max(crease.width[0], crease.width[1]) == Approx(2.5));
    }
}

TEST_CASE("the distance of chords from a crease is that of the farthest of all places") {
    for (double turn_deg : {5.0, 15.0, 30.0})
        for (const auto& [a, b, size] : {std::array{10.0, 10.0, 1.0}, std::array{0.2, 10.0, 1.0},
                                         std::array{0.3, 0.1, 1.0}, std::array{3.0, 3.0, 4.0}}) {
            const Crease crease{{0, 1}, {0, 1}, turn_deg * kRadian, {a, b}};
            const double expected = brute_force_distance(a, b, turn_deg * kRadian, size);
            CHECK(chord_distance(crease, size) <= 1.05 * expected);
            CHECK(chord_distance(crease, size) >= 0.75 * expected);
        }
    CHECK(chord_distance({{0, 1}, {0, 1}, 0.5, {0, 1}}, 1) == 0);
}

TEST_CASE("long creases between wide faces are features below the feature angle") {
    BoundaryOptions options;
    options.feature_angle_deg = 30;
    const TriangleSoup roof = make_folded_strip({2, 2}, {20}, 4, 4);
    SECTION("where quads across them would leave the surface") {
        const auto edges = find_weak_creases(roof, options, {0.2, 0.01});
        REQUIRE(edges);
        CHECK(edges->size() == 4);
        for (const auto& [a, b] : *edges) {
            CHECK(roof.vertices[a].x == Approx(2));
            CHECK(roof.vertices[b].x == Approx(2));
        }
    }
    SECTION("not where these stay near enough") {
        CHECK(find_weak_creases(roof, options, {0.2, 0.02})->empty());
    }
    SECTION("nor between faces of few cells") {
        CHECK(find_weak_creases(roof, options, {0.7, 0.01})->empty());
    }
    SECTION("nor where they are features already") {
        options.feature_angle_deg = 15;
        CHECK(find_weak_creases(roof, options, {0.2, 0.01})->empty());
    }
    SECTION("nor where no size is known") { CHECK(find_weak_creases(roof, options, {0, 0.01})->empty()); }
    SECTION("nor facets of a curved surface") {
        const TriangleSoup arc =
            make_folded_strip(std::vector<double>(9, 0.3), std::vector<double>(8, 10), 4, 4);
        CHECK(find_weak_creases(arc, options, {0.2, 0.001})->empty());
    }
}

TEST_CASE("creases that end are continued to the next feature") {
    // A roof of 20 degrees whose faces narrow towards y = 0.
    BoundaryOptions options;
    options.feature_angle_deg = 30;
    TriangleSoup roof = make_folded_strip({2, 2}, {20}, 4, 4);
    for (Index side : {0, 2}) roof.vertices[side] = 0.15 * roof.vertices[side] + 0.85 * roof.vertices[1];
    const auto reaches_end = [&] {
        const auto edges = find_weak_creases(roof, options, {0.3, 0.01});
        REQUIRE(edges);
        REQUIRE(edges->size() >= 3);
        return std::any_of(edges->begin(), edges->end(), [](const auto& edge) { return edge[0] == 1; });
    };
    CHECK_FALSE(reaches_end());
    // Faces that stand on the end of the roof.
    const Index first = static_cast<Index>(roof.vertices.size());
    for (Index k = 0; k < 3; ++k) roof.vertices.push_back(roof.vertices[k] - Point(0, 0.2, 1));
    for (Index k = 0; k < 2; ++k) {
        roof.triangles.push_back({first + k, first + k + 1, k + 1});
        roof.triangles.push_back({first + k, k + 1, k});
    }
    CHECK(reaches_end());
}

TEST_CASE("a soup that cannot be read as a surface is refused") {
    TriangleSoup soup = make_folded_strip({1, 1}, {20}, 1, 1);
    soup.triangles[0][1] = 99;
    const auto edges = find_weak_creases(soup, {}, {0.1, 0.01});
    REQUIRE_FALSE(edges);
    CHECK(edges.error().code == ErrorCode::bad_input);
}

} // namespace hexopt
