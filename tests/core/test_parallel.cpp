#include "core/context.hpp"
#include "core/parallel.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

using namespace hexopt;

TEST_CASE("a chunked sum has the same bits for any number of threads") {
    const std::size_t count = 100003;
    std::vector<double> terms(count);
    for (std::size_t i = 0; i < count; ++i)
        terms[i] = std::sin(static_cast<double>(i)) * std::pow(10.0, i % 17);
    const auto sum = [&](int threads) {
        const Parallel parallel(threads);
        return parallel.reduce(
            count, 1000, 0.0,
            [&](std::size_t begin, std::size_t end) {
                return std::accumulate(terms.begin() + begin, terms.begin() + end, 0.0);
            },
            [](double a, double b) { return a + b; });
    };
    const double serial = sum(1);
    for (int threads : {0, 2, 3, 8}) CHECK(sum(threads) == serial);
}

TEST_CASE("every item is visited once") {
    const Parallel parallel(4);
    for (std::size_t count : {0, 1, 7, 64, 1001}) {
        std::vector<int> visits(count, 0);
        parallel.for_each(count, 10, [&](std::size_t i) { ++visits[i]; });
        CHECK(std::all_of(visits.begin(), visits.end(), [](int v) { return v == 1; }));
    }
}

TEST_CASE("progress never falls and cancel is sticky") {
    Context context(1);
    std::vector<double> seen;
    context.set_progress_sink([&](std::string_view, double f, std::string_view) { seen.push_back(f); });
    for (double f : {0.1, 0.5, 0.3, 2.0}) context.report("x", f);
    CHECK(seen == std::vector<double>{0.1, 0.5, 0.5, 1.0});
    CHECK_FALSE(context.is_cancelled());
    context.cancel();
    CHECK(context.is_cancelled());
}
