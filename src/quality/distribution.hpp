#pragma once

#include <cstddef>
#include <vector>

namespace hexopt {

/// A figure over many cells. All zero when there are none.
struct Distribution {
    std::size_t count = 0;
    double min = 0, max = 0, mean = 0;
    /// Percentiles by nearest rank: of the sorted values the one at place p (count - 1) / 100, rounded.
    double p0_1 = 0, p1 = 0, p5 = 0, p50 = 0, p95 = 0, p99 = 0, p99_9 = 0;
};

/// Reorders `values`, which must not be NaN; infinities are allowed. Cost: linear.
Distribution compute_distribution(std::vector<double>& values);

/// Counts in bins of equal width: bin i holds low + i*width <= value < low + (i+1)*width; values outside go
/// to the first and last bin.
struct Histogram {
    double low = 0, width = 1;
    std::vector<std::size_t> count;

    Histogram() = default;
    Histogram(double from, double bin_width, std::size_t bins) : low(from), width(bin_width), count(bins) {}
    void add(double value);
    void add(const Histogram& other); ///< of the same bins
    std::size_t total() const;
};

} // namespace hexopt
