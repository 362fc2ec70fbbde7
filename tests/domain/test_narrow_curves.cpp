#include "domain/drop_curves.hpp"
#include "domain/narrow_curves.hpp"
#include "domain/tapered_chamfer.hpp"

#include "core/random.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

using namespace hexopt;

namespace {

Result<Domain> tapered_chamfer(Context& context) {
    BoundaryOptions features;
    features.feature_angle_deg = 20;
    return build_domain(test::tapered_chamfer(), features, context);
}

/// A cylinder of radius 1 between z = 0 and 1: two loops without a corner.
Result<Domain> cylinder(Context& context) {
    constexpr Index kSides = 48;
    TriangleSoup soup;
    for (Index k = 0; k < kSides; ++k) {
        const double a = 2 * std::numbers::pi * k / kSides;
        for (double z : {0.0, 1.0}) soup.vertices.emplace_back(std::cos(a), std::sin(a), z);
    }
    soup.vertices.emplace_back(0, 0, 0);
    soup.vertices.emplace_back(0, 0, 1);
    for (Index k = 0; k < kSides; ++k) {
        const Index a = 2 * k, b = 2 * ((k + 1) % kSides);
        soup.triangles.push_back({a, b, b + 1});
        soup.triangles.push_back({a, b + 1, a + 1});
        soup.triangles.push_back({2 * kSides, b, a});
        soup.triangles.push_back({2 * kSides + 1, a + 1, b + 1});
    }
    return build_domain(soup, {}, context);
}

double curve_length(const BoundaryModel& model, Index curve) {
    const auto points = model.curve_points(curve);
    double length = 0;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) length += glm::distance(points[i], points[i + 1]);
    return length;
}

double surface_area(const BoundaryModel& model) {
    double area = 0;
    for (Index t = 0; t < model.triangle_count(); ++t) {
        const auto& [a, b, c] = model.triangle(t);
        area += 0.5 * glm::length(glm::cross(b - a, c - a));
    }
    return area;
}

double total_length(const BoundaryModel& model) {
    double length = 0;
    for (Index c = 0; c < model.curve_count(); ++c) length += curve_length(model, c);
    return length;
}

} // namespace

TEST_CASE("cutting curves adds corners and pieces and leaves the surface as it is") {
    Context context(1);
    Random random(7);
    for (const bool is_loop : {false, true}) {
        const auto whole = is_loop ? cylinder(context) : tapered_chamfer(context);
        REQUIRE(whole);
        for (int round = 0; round < 20; ++round) {
            CAPTURE(is_loop, round);
            std::vector<CurveCut> cuts;
            std::size_t pieces = whole->model.curve_count();
            for (Index c = 0; c < whole->model.curve_count(); ++c) {
                const auto count = static_cast<std::size_t>(random.uniform(0, 3.999));
                for (std::size_t k = 0; k < count; ++k)
                    cuts.push_back({c, random.uniform(0.01, 0.99) * curve_length(whole->model, c)});
                pieces += is_loop && count > 0 ? count - 1 : count;
            }
            std::sort(cuts.begin(), cuts.end());
            const auto split = split_curves(*whole, cuts, context);
            REQUIRE(split);
            CHECK(split->model.curve_count() == pieces);
            CHECK(split->model.corner_count() == whole->model.corner_count() + cuts.size());
            CHECK(split->model.patch_count() == whole->model.patch_count());
            CHECK(surface_area(split->model) == Approx(surface_area(whole->model)));
            CHECK(total_length(split->model) == Approx(total_length(whole->model)));
            for (Index c = 0; c < split->model.curve_count(); ++c) CHECK(split->curve_patch[c].size() == 2);
            for (Index c = 0; c < whole->model.curve_count(); ++c) { // the first piece keeps the number
                const Point p = split->model.curve_points(c)[1];
                CHECK(whole->model.project_curve(c, p).distance < 1e-12);
            }
        }
    }
}

TEST_CASE("cuts that are not inside a curve or out of order are refused") {
    Context context(1);
    const auto whole = tapered_chamfer(context);
    REQUIRE(whole);
    const double length = curve_length(whole->model, 0);
    using Cuts = std::vector<CurveCut>;
    for (const Cuts& cuts : {Cuts{{0, 0}}, Cuts{{0, length}}, Cuts{{0, -1}}, Cuts{{0, 2 * length}},
                             Cuts{{0, 0.6 * length}, {0, 0.3 * length}}, Cuts{{1, 0.1}, {0, 0.1}},
                             Cuts{{99, 0.1}}, Cuts{{0, std::nan("")}}}) {
        const auto split = split_curves(*whole, cuts, context);
        REQUIRE(!split);
        CHECK(split.error().code == ErrorCode::usage);
    }
}

TEST_CASE("a cusp is cut back to where cells fit between its curves") {
    Context context(1);
    const auto whole = tapered_chamfer(context);
    REQUIRE(whole);
    REQUIRE(whole->model.curve_count() == 14);
    const double cell = 0.25;
    const NarrowCurves found = find_narrow_curves(*whole, [&](const Point&) { return cell; }, {});
    REQUIRE(found.cuts.size() == 1);
    REQUIRE(found.narrow.size() == 1);
    const auto split = split_curves(*whole, found.cuts, context);
    REQUIRE(split);
    // The part of AQ that goes: from A on to where AP is 0.3 cells away.
    const auto points = split->model.curve_points(found.narrow[0]);
    const Point tip(0, 1, 1);
    const Point end = glm::distance(points.front(), tip) < 1e-12 ? points.back() : points.front();
    CHECK(std::min(glm::distance(points.front(), tip), glm::distance(points.back(), tip)) < 1e-12);
    CHECK(end.y == Approx(1));
    const double width = glm::distance(end, Point(end.x, 1 - 0.05 * end.x, 1));
    CHECK(width == Approx(0.3 * cell).margin(0.3 * 0.1 * cell));
    const auto left = drop_curves(*split, found.narrow, context);
    REQUIRE(left);
    CHECK(left->model.curve_count() == 14);
    CHECK(left->model.patch_count() == whole->model.patch_count() - 1);
    CHECK(total_length(left->model) == Approx(total_length(whole->model) - glm::distance(end, tip)));
}

TEST_CASE("nothing is narrow for small cells, and sharp curves or names are not given up") {
    Context context(1);
    const auto whole = tapered_chamfer(context);
    REQUIRE(whole);
    const auto count = [&](double cell, const NarrowOptions& options) {
        return find_narrow_curves(
                   *whole, [&](const Point&) { return cell; }, options)
            .narrow.size();
    };
    CHECK(count(0, {}) == 0);
    NarrowOptions options;
    options.below_deg = 20;
    CHECK(count(0.25, options) == 0);
    options.below_deg = 60;
    options.shortest = 4;
    CHECK(count(0.25, options) == 0);
    // Cells as large as the box: all of AQ runs beside AP.
    const NarrowCurves all = find_narrow_curves(*whole, [](const Point&) { return 2.0; }, {});
    CHECK(all.cuts.empty());
    CHECK(all.narrow.size() == 1);
}

TEST_CASE("curves side by side that never meet are kept") {
    Context context(1);
    // A cylinder with a bevel 0.02 wide below its upper rim, which turns by 70 and 20 degrees.
    constexpr Index kSides = 64;
    TriangleSoup soup;
    const double inset = 0.02 * std::sin(20 * std::numbers::pi / 180),
                 drop = 0.02 * std::cos(20 * std::numbers::pi / 180);
    for (Index k = 0; k < kSides; ++k) {
        const double a = 2 * std::numbers::pi * k / kSides;
        for (const auto& [r, z] : {std::pair{1.0, 0.0}, {1.0, 1 - drop}, {1 - inset, 1.0}})
            soup.vertices.emplace_back(r * std::cos(a), r * std::sin(a), z);
    }
    soup.vertices.emplace_back(0, 0, 0);
    soup.vertices.emplace_back(0, 0, 1);
    for (Index k = 0; k < kSides; ++k) {
        const Index a = 3 * k, b = 3 * ((k + 1) % kSides);
        for (Index s : {Index{0}, Index{1}}) {
            soup.triangles.push_back({a + s, b + s, b + s + 1});
            soup.triangles.push_back({a + s, b + s + 1, a + s + 1});
        }
        soup.triangles.push_back({3 * kSides, b, a});
        soup.triangles.push_back({3 * kSides + 1, a + 2, b + 2});
    }
    BoundaryOptions features;
    features.feature_angle_deg = 15;
    const auto whole = build_domain(soup, features, context);
    REQUIRE(whole);
    REQUIRE(whole->model.curve_count() == 3);
    const NarrowCurves found = find_narrow_curves(*whole, [](const Point&) { return 0.1; }, {});
    CHECK(found.cuts.empty());
    CHECK(found.narrow.empty());
}

TEST_CASE("both edges of a ledge go where it is narrow, and neither where it is wide") {
    Context context(1);
    // A box of 4 x 2 x 2 whose front has a ledge at z = 1, 0.01 deep at x = 0 and 0.21 at x = 4.
    TriangleSoup soup;
    soup.vertices = {{0, 0, 0},    {4, 0, 0},    {4, 0, 1}, {0, 0, 1}, {0, 0.01, 1}, {4, 0.21, 1},
                     {0, 0.01, 2}, {4, 0.21, 2}, {0, 2, 0}, {4, 2, 0}, {4, 2, 2},    {0, 2, 2}};
    test::add_polygon(soup, {0, 1, 2, 3});
    test::add_polygon(soup, {3, 2, 5, 4});
    test::add_polygon(soup, {4, 5, 7, 6});
    test::add_polygon(soup, {6, 7, 10, 11});
    test::add_polygon(soup, {9, 8, 11, 10});
    test::add_polygon(soup, {1, 0, 8, 9});
    test::add_polygon(soup, {8, 0, 3, 4}); // the side x = 0 as a fan that holds the ledge
    test::add_polygon(soup, {8, 4, 6, 11});
    test::add_polygon(soup, {5, 2, 1, 9});
    test::add_polygon(soup, {5, 9, 10, 7});
    const auto whole = build_domain(soup, {}, context);
    REQUIRE(whole);
    REQUIRE(whole->open_edges == 0);
    const NarrowCurves found = find_narrow_curves(*whole, [](const Point&) { return 0.5; }, {});
    REQUIRE(found.narrow.size() == 2);
    const auto split = split_curves(*whole, found.cuts, context);
    REQUIRE(split);
    // 0.15 cells are 0.075 wide, which the ledge is at x = 1.3.
    for (Index c : found.narrow) {
        const auto points = split->model.curve_points(c);
        const auto [low, high] = std::minmax(points.front().x, points.back().x);
        CHECK(low == 0);
        CHECK(high == Approx(1.3).margin(0.15));
        CHECK(points.front().z == Approx(1));
    }
}
