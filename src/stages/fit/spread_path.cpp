#include "stages/fit/spread_path.hpp"

#include <algorithm>

namespace hexopt::fit {

namespace {

/// What steps in proportion count against nearness: differences between neighbours even out over some four
/// vertices, and no farther, so that a path whose edges are denser in one half stays there.
constexpr double kEven = 16;
/// Least step between two vertices, over the one in proportion.
constexpr double kLeastStep = 0.3;

/// The rising sequence that is nearest to `value` by the sum of squares.
std::vector<double> make_rising(std::span<const double> value) {
    struct Block {
        double sum;
        std::size_t count;
        double mean() const { return sum / static_cast<double>(count); }
    };
    std::vector<Block> blocks;
    for (double v : value) {
        Block block{v, 1};
        for (; !blocks.empty() && blocks.back().mean() > block.mean(); blocks.pop_back()) {
            block.sum += blocks.back().sum;
            block.count += blocks.back().count;
        }
        blocks.push_back(block);
    }
    std::vector<double> rising;
    for (const Block& block : blocks) rising.insert(rising.end(), block.count, block.mean());
    return rising;
}

/// The x that makes the sum of (x_i - near_i)^2 / h_i^2 + kEven (x_i - x_{i-1} - step_i)^2 / step_i^2 least,
/// h_i the mean of the steps beside i; the first and the last stay. step[0] counts for nothing.
std::vector<double> balance_steps(std::span<const double> near, std::span<const double> step) {
    const std::size_t n = near.size();
    std::vector<double> x(near.begin(), near.end()), factor(n, 0), rest(x);
    for (std::size_t i = 1; i + 1 < n; ++i) { // Thomas's algorithm for a tridiagonal system
        const double before = kEven / (step[i] * step[i]), after = kEven / (step[i + 1] * step[i + 1]);
        const double h = 0.5 * (step[i] + step[i + 1]), own = 1 / (h * h);
        const double right = own * near[i] + before * step[i] - after * step[i + 1];
        const double pivot = own + before + after - before * factor[i - 1];
        factor[i] = after / pivot;
        rest[i] = (right + before * rest[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) x[i] = rest[i] + factor[i] * x[i + 1];
    return x;
}

} // namespace

std::vector<double> spread_path(const Leg& leg, std::array<double, 2> ends, std::span<const Index> path,
                                const SurfaceMesh& surface, std::span<const Point> placed) {
    const std::size_t n = path.size();
    if (!(ends[1] > ends[0])) return std::vector<double>(n, ends[0]);
    std::vector<double> step(n, 0), least(n, 0);
    double sum = 0;
    for (std::size_t i = 1; i < n; ++i)
        sum += step[i] = 0.5 * (surface.size[path[i - 1]] + surface.size[path[i]]);
    for (std::size_t i = 1; i < n; ++i) {
        step[i] *= (ends[1] - ends[0]) / sum;
        least[i] = least[i - 1] + kLeastStep * step[i];
    }
    std::vector<double> near(n);
    for (std::size_t i = 0; i < n; ++i)
        near[i] = std::clamp(closest_arc_length(leg, placed[path[i]]), ends[0], ends[1]);
    near.front() = ends[0], near.back() = ends[1];
    std::vector<double> arc = balance_steps(near, step);
    for (std::size_t i = 0; i < n; ++i) arc[i] -= least[i];
    arc = make_rising(arc);
    for (std::size_t i = 0; i < n; ++i)
        arc[i] = std::clamp(arc[i], ends[0], ends[1] - least.back()) + least[i];
    return arc;
}

} // namespace hexopt::fit
