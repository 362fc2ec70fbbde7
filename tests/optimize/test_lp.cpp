#include "stages/optimize/lp_kernel.hpp"
#include "stages/optimize/lp_simplex.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <optional>
#include <random>

using namespace hexopt;

namespace {

/// Rows a.x <= b in N variables.
template <int N>
struct Polyhedron {
    std::vector<Eigen::Matrix<double, N, 1>> a;
    std::vector<double> b;
    void add(const Eigen::Matrix<double, N, 1>& row, double bound) { a.push_back(row), b.push_back(bound); }
};

/// Largest c.x over all vertices, each found as the crossing of N of the planes: an oracle without any LP.
template <int N>
std::optional<double> best_vertex(const Polyhedron<N>& p, const Eigen::Matrix<double, N, 1>& c,
                                  double tolerance = 1e-9) {
    std::optional<double> best;
    std::vector<int> chosen(p.a.size(), 0);
    std::fill_n(chosen.begin(), N, 1);
    do {
        Eigen::Matrix<double, N, N> m;
        Eigen::Matrix<double, N, 1> rhs;
        for (int i = 0, row = 0; i < static_cast<int>(chosen.size()); ++i)
            if (chosen[i]) m.row(row) = p.a[i].transpose(), rhs[row++] = p.b[i];
        const Eigen::FullPivLU<Eigen::Matrix<double, N, N>> lu(m);
        if (lu.rcond() < 1e-12) continue;
        const Eigen::Matrix<double, N, 1> x = lu.solve(rhs);
        bool inside = true;
        for (std::size_t i = 0; i < p.a.size() && inside; ++i) inside = p.a[i].dot(x) <= p.b[i] + tolerance;
        if (inside && (!best || c.dot(x) > *best)) best = c.dot(x);
    } while (std::prev_permutation(chosen.begin(), chosen.end()));
    return best;
}

struct RandomKernel {
    std::vector<HalfSpace> planes;
    PointBox box{Point(-1, -2, -0.5), Point(1.5, 1, 2)};

    RandomKernel(int count, double inward, std::uint64_t seed) {
        std::mt19937_64 random(seed);
        std::normal_distribution<double> normal;
        std::uniform_real_distribution<double> offset(inward - 1, inward + 1);
        for (int i = 0; i < count; ++i)
            planes.push_back(
                {glm::normalize(Point(normal(random), normal(random), normal(random))), offset(random)});
    }

    Polyhedron<3> kernel() const {
        Polyhedron<3> p;
        for (const HalfSpace& h : planes) p.add({-h.normal.x, -h.normal.y, -h.normal.z}, h.offset);
        for (int i = 0; i < 3; ++i) {
            p.add(Eigen::Vector3d::Unit(i), box.high[i]);
            p.add(-Eigen::Vector3d::Unit(i), -box.low[i]);
        }
        return p;
    }
    Polyhedron<4> with_depth() const {
        Polyhedron<4> p;
        for (const HalfSpace& h : planes) p.add({-h.normal.x, -h.normal.y, -h.normal.z, 1}, h.offset);
        for (int i = 0; i < 3; ++i) {
            p.add(Eigen::Vector4d::Unit(i), box.high[i]);
            p.add(-Eigen::Vector4d::Unit(i), -box.low[i]);
        }
        return p;
    }
    bool contains(const Point& p, double tolerance) const {
        for (int i = 0; i < 3; ++i)
            if (p[i] < box.low[i] - tolerance || p[i] > box.high[i] + tolerance) return false;
        return depth_at(planes, p) > -tolerance;
    }
};

} // namespace

TEST_CASE("the deepest point is as deep as the best of all crossings of four planes") {
    int empty = 0;
    for (std::uint64_t seed = 0; seed < 150; ++seed) {
        const int count = 1 + static_cast<int>(seed % 9);
        const RandomKernel k(count, seed % 3 == 0 ? -0.5 : 0.6, seed);
        const auto oracle = best_vertex<4>(k.with_depth(), Eigen::Vector4d::Unit(3));
        REQUIRE(oracle);
        const DeepestPoint deepest = find_deepest_point(k.planes, k.box, seed);
        CHECK(deepest.depth == Approx(*oracle).margin(1e-9));
        empty += deepest.depth < 0;
        for (int i = 0; i < 3; ++i) {
            CHECK(deepest.point[i] >= k.box.low[i] - 1e-12);
            CHECK(deepest.point[i] <= k.box.high[i] + 1e-12);
        }
    }
    CHECK(empty > 10);
}

TEST_CASE("the deepest point of many planes does not depend on their order or the seed") {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        RandomKernel k(200, 1.2, seed);
        const double depth = find_deepest_point(k.planes, k.box, 1).depth;
        std::reverse(k.planes.begin(), k.planes.end());
        CHECK(find_deepest_point(k.planes, k.box, 77).depth == Approx(depth).margin(1e-10));
    }
}

TEST_CASE("deepest points of degenerate kernels") {
    const PointBox box{Point(-1), Point(1)};
    SECTION("no plane at all: any point of the box") {
        const DeepestPoint d = find_deepest_point({}, box, 1);
        CHECK(glm::length(d.point) <= std::sqrt(3.0));
    }
    SECTION("two opposite planes that touch: depth 0 on them") {
        const std::vector<HalfSpace> slab = {{Point(1, 0, 0), -0.25}, {Point(-1, 0, 0), 0.25}};
        const DeepestPoint d = find_deepest_point(slab, box, 1);
        CHECK(d.depth == Approx(0).margin(1e-12));
        CHECK(d.point.x == Approx(0.25));
    }
    SECTION("two opposite planes that miss each other: half the gap") {
        const std::vector<HalfSpace> gap = {{Point(0, 1, 0), -0.5}, {Point(0, -1, 0), -0.1}};
        const DeepestPoint d = find_deepest_point(gap, box, 1);
        CHECK(d.depth == Approx(-0.3));
        CHECK(d.point.y == Approx(0.2));
    }
    SECTION("the same plane many times") {
        const std::vector<HalfSpace> same(50, {Point(0, 0, 1), 0.5});
        CHECK(find_deepest_point(same, box, 3).depth == Approx(1.5));
    }
    SECTION("a flat box") {
        const PointBox flat{Point(-1, -1, 0), Point(1, 1, 0)};
        const std::vector<HalfSpace> one = {{Point(0, 0.6, 0.8), 0}};
        const DeepestPoint d = find_deepest_point(one, flat, 3);
        CHECK(d.depth == Approx(0.6));
        CHECK(d.point.z == 0);
    }
    SECTION("a cone with its apex in the box, no interior") {
        std::vector<HalfSpace> cone;
        for (const Point n : {Point(1, 1, 1), Point(-1, -1, 1), Point(-1, 1, -1), Point(1, -1, -1)})
            cone.push_back({glm::normalize(n), -glm::dot(glm::normalize(n), Point(0.3, 0.2, 0.1))});
        const DeepestPoint d = find_deepest_point(cone, box, 9);
        CHECK(d.depth == Approx(0).margin(1e-12));
        CHECK(glm::distance(d.point, Point(0.3, 0.2, 0.1)) < 1e-10);
    }
}

TEST_CASE("the simplex method reaches the best vertex along all 26 targets, or says that there is none") {
    int empty = 0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const RandomKernel k(2 + static_cast<int>(seed % 12), seed % 4 == 0 ? -0.3 : 0.7, 1000 + seed);
        const Polyhedron<3> p = k.kernel();
        Simplex<double> simplex(3, 1e-11);
        for (std::size_t i = 0; i < p.a.size(); ++i)
            simplex.add_row(std::array{p.a[i][0], p.a[i][1], p.a[i][2]},
                            p.b[i] - p.a[i].dot(Eigen::Vector3d(k.box.low.x, k.box.low.y, k.box.low.z)));
        const bool feasible = simplex.find_feasible();
        CHECK(feasible == best_vertex<3>(p, Eigen::Vector3d::Zero()).has_value());
        empty += !feasible;
        if (!feasible) continue;
        for (int t = 0; t < 27; ++t) {
            const Eigen::Vector3d c(t % 3 - 1, t / 3 % 3 - 1, t / 9 - 1);
            REQUIRE(simplex.maximise(std::array{c[0], c[1], c[2]}));
            const double shift = c.dot(Eigen::Vector3d(k.box.low.x, k.box.low.y, k.box.low.z));
            CHECK(simplex.value() + shift == Approx(*best_vertex<3>(p, c)).margin(1e-8));
        }
    }
    CHECK(empty > 10);
}

TEST_CASE("the multipliers of the simplex method are a dual solution of equal value") {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> unit(0.1, 1);
    for (int trial = 0; trial < 100; ++trial) {
        Simplex<double> simplex(3, 1e-12);
        std::vector<std::array<double, 3>> a;
        std::vector<double> b;
        for (int i = 0; i < 8; ++i) {
            a.push_back({unit(random), unit(random), unit(random)});
            b.push_back(unit(random));
            simplex.add_row(a.back(), b.back());
        }
        const std::array<double, 3> c = {unit(random), unit(random), unit(random)};
        REQUIRE(simplex.find_feasible());
        REQUIRE(simplex.maximise(c));
        const auto y = simplex.multipliers();
        double value = 0;
        for (std::size_t i = 0; i < b.size(); ++i) {
            CHECK(y[i] >= 0);
            value += y[i] * b[i];
        }
        CHECK(value == Approx(simplex.value()));
        for (int j = 0; j < 3; ++j) {
            double sum = 0;
            for (std::size_t i = 0; i < b.size(); ++i) sum += y[i] * a[i][j];
            CHECK(sum >= c[j] - 1e-9);
        }
    }
}

TEST_CASE("an unbounded program is told from an empty one") {
    Simplex<double> open(2, 1e-12);
    open.add_row(std::array{-1.0, 1.0}, 1.0);
    REQUIRE(open.find_feasible());
    CHECK_FALSE(open.maximise(std::array{1.0, 0.0}));
    Simplex<double> empty(2, 1e-12);
    empty.add_row(std::array{1.0, 1.0}, -1.0);
    CHECK_FALSE(empty.find_feasible());
}

TEST_CASE("averages of extreme points lie in the kernel, the extended one strictly inside") {
    int strict = 0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const RandomKernel k(8 + static_cast<int>(seed % 90), 1.0, seed);
        const double depth = find_deepest_point(k.planes, k.box, 1).depth;
        const auto axis = average_extremes(k.planes, k.box, false);
        const auto extended = average_extremes(k.planes, k.box, true);
        CHECK(axis.has_value() == extended.has_value());
        if (depth > 1e-6) REQUIRE(extended);
        if (depth < -1e-6) REQUIRE_FALSE(extended);
        if (!extended) continue;
        CHECK(k.contains(*axis, 1e-9));
        CHECK(k.contains(*extended, 1e-9));
        if (depth > 1e-3) {
            CHECK(depth_at(k.planes, *extended) > 0);
            ++strict;
        }
    }
    CHECK(strict > 20);
}

TEST_CASE("a kernel whose axis average stays on its boundary is resolved by the extended targets") {
    // The six axis targets all meet the plane x + y + z = 1 of a corner tetrahedron's far side only in the
    // tips; a thin prism along (1,-1,0) has its axis extremes at its two ends.
    const Point along = glm::normalize(Point(1, -1, 0));
    const Point side = glm::normalize(Point(1, 1, 0));
    std::vector<HalfSpace> prism = {{side, 0.01},           {-side, 0.01},
                                    {Point(0, 0, 1), 0.01}, {Point(0, 0, -1), 0.01},
                                    {along, 0.5},           {-along, 0.5}};
    const auto extended = average_extremes(prism, {Point(-1), Point(1)}, true);
    REQUIRE(extended);
    CHECK(depth_at(prism, *extended) > 1e-4);
}
