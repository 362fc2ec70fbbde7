#include "stages/fit/curve_net.hpp"
#include "stages/fit/spread_path.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

using namespace hexopt;

namespace {

/// A straight leg along x.
fit::Leg make_leg(double length) { return {0, {0, 1}, {Point(0), Point(length, 0, 0)}, {0, length}}; }

/// A surface of which nothing but the sizes at vertices is known.
fit::SurfaceMesh make_surface(std::vector<double> size) {
    fit::SurfaceMesh surface;
    surface.size = std::move(size);
    return surface;
}

std::vector<Index> count_up(std::size_t n) {
    std::vector<Index> path(n);
    std::iota(path.begin(), path.end(), Index{0});
    return path;
}

/// A prism over a regular polygon of 60 sides, its two closed edges features.
TriangleSoup make_disc() {
    TriangleSoup soup;
    constexpr int kSides = 60;
    for (int z = 0; z < 2; ++z) {
        for (int k = 0; k < kSides; ++k) {
            const double a = 2 * std::numbers::pi * k / kSides;
            soup.vertices.emplace_back(std::cos(a), std::sin(a), 0.4 * z);
        }
        soup.vertices.emplace_back(0, 0, 0.4 * z);
    }
    const auto at = [&](int k, int z) { return static_cast<Index>(k % kSides + z * (kSides + 1)); };
    const Index bottom = kSides, top = 2 * kSides + 1;
    for (int k = 0; k < kSides; ++k) {
        soup.triangles.push_back({bottom, at(k + 1, 0), at(k, 0)});
        soup.triangles.push_back({top, at(k, 1), at(k + 1, 1)});
        soup.triangles.push_back({at(k, 0), at(k + 1, 0), at(k + 1, 1)});
        soup.triangles.push_back({at(k, 0), at(k + 1, 1), at(k, 1)});
    }
    return soup;
}

} // namespace

TEST_CASE("paths: where edges are denser than their sizes tell, vertices stay near their places") {
    // Edges follow a curve at a right angle to the lattice in one half and across it in the other, where two
    // of them make one step along the curve.
    std::vector<Point> placed = {Point(0)};
    for (int i = 0; i < 40; ++i) placed.push_back(placed.back() + Point(1, 0, 0));
    for (int i = 0; i < 80; ++i) placed.push_back(placed.back() + Point(0.5, i % 2 == 0 ? 0.6 : -0.6, 0));
    const std::size_t n = placed.size();
    const fit::SurfaceMesh surface = make_surface(std::vector<double>(n, 1.0));
    const std::vector<double> arc = fit::spread_path(make_leg(80), {0, 80}, count_up(n), surface, placed);
    for (std::size_t i = 0; i < n; ++i) {
        CAPTURE(i);
        CHECK(std::abs(arc[i] - placed[i].x) < 1.2);
    }
}

TEST_CASE("paths: no vertex overtakes another, wherever their closest points are") {
    std::mt19937 random(7);
    for (int round = 0; round < 200; ++round) {
        std::uniform_real_distribution<double> unit(0, 1);
        const std::size_t n = 2 + random() % 40;
        const double length = 0.1 + 10 * unit(random);
        std::vector<double> size(n);
        std::vector<Point> placed(n);
        for (std::size_t i = 0; i < n; ++i) {
            size[i] = std::exp2(2 * unit(random));
            placed[i] = Point(length * (1.4 * unit(random) - 0.2), unit(random), 0);
        }
        const std::array<double, 2> ends = {0.1 * length, 0.8 * length};
        const std::vector<double> arc =
            fit::spread_path(make_leg(length), ends, count_up(n), make_surface(size), placed);
        REQUIRE(arc.size() == n);
        CHECK(arc.front() == Approx(ends[0]));
        CHECK(arc.back() == Approx(ends[1]));
        double sum = 0;
        for (std::size_t i = 1; i < n; ++i) sum += 0.5 * (size[i - 1] + size[i]);
        for (std::size_t i = 1; i < n; ++i) {
            const double even = 0.5 * (size[i - 1] + size[i]) / sum * (ends[1] - ends[0]);
            CHECK(arc[i] - arc[i - 1] > 0.29 * even);
        }
    }
}

TEST_CASE("paths: a piece without length puts its vertices on its place") {
    const std::vector<Point> placed = {Point(1, 1, 0), Point(2, 1, 0), Point(3, 0, 0)};
    const fit::SurfaceMesh surface = make_surface({1, 1, 1});
    for (double arc : fit::spread_path(make_leg(4), {2, 2}, count_up(3), surface, placed)) CHECK(arc == 2);
}

TEST_CASE("paths: the rest of a closed curve is far from a leg of it") {
    Context context(1);
    const auto domain = build_domain(make_disc(), {}, context);
    REQUIRE(domain);
    REQUIRE(domain->model.curve_count() == 2);
    const fit::CurveNet net = fit::make_curve_net(*domain, fit::find_small_features(*domain, {}));
    REQUIRE(net.legs.size() == 8);
    for (Index l = 0; l < net.legs.size(); ++l) {
        const fit::Leg& leg = net.legs[l];
        const Point middle = fit::point_at(leg, 0.5 * leg.length());
        const Point opposite(-middle.x, -middle.y, middle.z);
        CHECK(fit::distance_from_leg(net, l, domain->model, middle) == Approx(0).margin(1e-12));
        CHECK(domain->model.project_curve(leg.curve, opposite).distance < 1e-2);
        CHECK(fit::distance_from_leg(net, l, domain->model, opposite) > 1.8); // 2 cos(45 deg / 2)
    }
}
