#include "quality/distribution.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace hexopt {

Distribution compute_distribution(std::vector<double>& values) {
    Distribution d;
    d.count = values.size();
    if (values.empty()) return d;
    // Summed before the values are reordered: the same bits as the cells' order gives.
    d.mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    d.min = *least;
    d.max = *most;
    auto from = values.begin();
    const auto percentile = [&](double percent) {
        const double place_of_percent = percent / 100 * static_cast<double>(values.size() - 1);
        const auto place = values.begin() + static_cast<std::ptrdiff_t>(std::floor(place_of_percent + 0.5));
        std::nth_element(from, place, values.end());
        from = place;
        return *place;
    };
    d.p0_1 = percentile(0.1);
    d.p1 = percentile(1);
    d.p5 = percentile(5);
    d.p50 = percentile(50);
    d.p95 = percentile(95);
    d.p99 = percentile(99);
    d.p99_9 = percentile(99.9);
    return d;
}

void Histogram::add(double value) {
    const double bin = std::floor((value - low) / width);
    const double last = static_cast<double>(count.size() - 1);
    ++count[static_cast<std::size_t>(std::clamp(bin, 0.0, last))];
}

void Histogram::add(const Histogram& other) {
    assert(other.count.size() == count.size());
    for (std::size_t i = 0; i < count.size(); ++i) count[i] += other.count[i];
}

std::size_t Histogram::total() const { return std::accumulate(count.begin(), count.end(), std::size_t{0}); }

} // namespace hexopt
