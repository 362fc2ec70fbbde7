#include "domain/smooth_borders.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace hexopt;

namespace {

constexpr double kLength = 10, kThick = 1;

/// A plate of thickness 1 that ends in a half cylinder at x = 0, its nose line at x = -0.5. Patches of one
/// group: above, below, all else; one more above from x = `far_from` on where that is positive.
TriangleSoup make_plate(double width, double far_from = 0) {
    constexpr int kSteps = 12;  // a quarter of a circle
    std::vector<Point> outline; // below from the back to the nose, then above
    outline.emplace_back(kLength, -kThick / 2, 0);
    if (far_from > 0) outline.emplace_back(far_from, -kThick / 2, 0);
    for (int k = -kSteps; k <= kSteps; ++k) {
        const double a = 0.5 * std::numbers::pi * k / kSteps;
        outline.emplace_back(-0.5 * kThick * std::cos(a), 0.5 * kThick * std::sin(a), 0);
    }
    if (far_from > 0) outline.emplace_back(far_from, kThick / 2, 0);
    outline.emplace_back(kLength, kThick / 2, 0);
    TriangleSoup soup;
    const auto n = static_cast<Index>(outline.size());
    for (double z : {0.0, width})
        for (const Point& p : outline) soup.vertices.emplace_back(p.x, p.y, z);
    const auto add = [&](Index a, Index b, Index c, Index patch) {
        soup.triangles.push_back({a, b, c});
        soup.patch.push_back(patch);
    };
    for (Index k = 0; k < n; ++k) {
        const Index next = (k + 1) % n;
        const bool above = outline[k].y >= 0 && k + 1 < n;
        const bool far = far_from > 0 && outline[k].x >= far_from;
        const Index patch = k + 1 == n ? 2 : !above ? 0 : far ? 3 : 1;
        add(k, k + n, next + n, patch);
        add(k, next + n, next, patch);
    }
    for (Index k = 1; k + 1 < n; ++k) {
        add(0, k, k + 1, 2);
        add(n, n + k + 1, n + k, 2);
    }
    soup.patch_names = {"below", "above", "rest", "far"};
    soup.patch_group = {0, 0, 0, 0};
    return soup;
}

SmoothBorders find(const TriangleSoup& soup, double size, const BoundaryOptions& options = {}) {
    const auto found = find_smooth_borders(soup, options, {}, [=](const Point&) { return size; });
    REQUIRE(found);
    return *found;
}

bool is_nose_only(const TriangleSoup& soup, const SmoothBorders& found) {
    return found.edges.size() == 1 && std::all_of(found.edges[0].begin(), found.edges[0].end(), [&](Index v) {
               return soup.vertices[v].x == -0.5 * kThick;
           });
}

} // namespace

TEST_CASE("a smooth border along a bend narrower than cells is followed") {
    const TriangleSoup plate = make_plate(20);
    const SmoothBorders found = find(plate, 0.8);
    CHECK(found.count == 1);
    CHECK(is_nose_only(plate, found));
}

TEST_CASE("a border is not followed where fine cells see no bend, nor where there are no cells") {
    CHECK(find(make_plate(20), 0.1).count == 0);
    CHECK(find(make_plate(20), 0).count == 0);
}

TEST_CASE("a border is not followed where it is shorter than four cells") {
    CHECK(find(make_plate(3.3), 0.8).count == 1);
    CHECK(find(make_plate(3.1), 0.8).count == 0);
}

TEST_CASE("a border is not followed where another line is nearer than four cells") {
    CHECK(find(make_plate(20, 3), 0.8).count == 1); // 3.5 - 0.5 away, measured from the nose
    CHECK(find(make_plate(20, 2), 0.8).count == 0);
}

TEST_CASE("borders are followed only between patches of one group, and where borders count") {
    TriangleSoup plate = make_plate(20);
    BoundaryOptions options;
    options.patch_borders = false;
    CHECK(find(plate, 0.8, options).count == 0);
    plate.patch_group.clear(); // all borders are features then
    CHECK(find(plate, 0.8).count == 0);
    plate.patch_group = {0, 1, 1, 1}; // the nose is one
    CHECK(find(plate, 0.8).count == 0);
}

TEST_CASE("broken surfaces are refused when their borders are looked for") {
    TriangleSoup plate = make_plate(20);
    plate.triangles[0][0] = 1000;
    CHECK_FALSE(find_smooth_borders(plate, {}, {}, [](const Point&) { return 1.0; }));
}
