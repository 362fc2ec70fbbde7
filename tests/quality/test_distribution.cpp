#include "quality/distribution.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

using namespace hexopt;

TEST_CASE("percentiles are nearest ranks") {
    std::mt19937_64 random(1);
    for (std::size_t n : {1u, 2u, 3u, 99u, 100u, 101u, 1000u, 12345u}) {
        std::vector<double> values(n);
        for (double& v : values) v = static_cast<double>(random() % 1000);
        std::vector<double> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        const Distribution d = compute_distribution(values);
        CHECK(d.count == n);
        CHECK(d.min == sorted.front());
        CHECK(d.max == sorted.back());
        const std::pair<double, double> percentiles[] = {
            {0.1, d.p0_1}, {1, d.p1}, {5, d.p5}, {50, d.p50}, {95, d.p95}, {99, d.p99}, {99.9, d.p99_9}};
        for (const auto& [percent, value] : percentiles) {
            const std::size_t rank =
                static_cast<std::size_t>(std::lround(percent / 100 * static_cast<double>(n - 1)));
            CHECK(value == sorted[rank]);
        }
    }
    std::vector<double> none;
    CHECK(compute_distribution(none).count == 0);
    std::vector<double> endless = {1, std::numeric_limits<double>::infinity()};
    const Distribution d = compute_distribution(endless);
    CHECK(d.min == 1);
    CHECK(std::isinf(d.mean));
}

TEST_CASE("a histogram's ends take what lies outside") {
    Histogram h(-1, 0.5, 4);
    for (double v : {-7.0, -1.0, -0.6, -0.5, 0.0, 0.25, 0.5, 1.0, 9.0}) h.add(v);
    CHECK(h.count == std::vector<std::size_t>{3, 1, 2, 3});
    Histogram other(-1, 0.5, 4);
    other.add(0);
    h.add(other);
    CHECK(h.total() == 10);
    CHECK(h.count[2] == 3);
}
