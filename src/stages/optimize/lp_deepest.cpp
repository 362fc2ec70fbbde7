#include "stages/optimize/lp_kernel.hpp"

#include "core/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Relative to the box, whose largest side is 1.
constexpr double kTolerance = 1e-12;

/// a.x <= b.
template <int D>
struct Row {
    std::array<double, D> a;
    double b;
};

template <int D>
using Vec = std::array<double, D>;

template <int D>
double dot(const Vec<D>& a, const Vec<D>& b) {
    double sum = 0;
    for (int i = 0; i < D; ++i) sum += a[i] * b[i];
    return sum;
}

/// Maximises c.x over rows and low <= x <= high, rows in the order given. The optimum of the first rows
/// either satisfies the next one or moves onto its boundary, where the problem has one variable less. The
/// polyhedron must not be empty; what rounding makes of one that is nearly so comes out slightly outside.
template <int D>
Vec<D> climb(std::span<const Row<D>> rows, const Vec<D>& c, const Vec<D>& low, const Vec<D>& high);

template <int D>
Vec<D> best_corner(const Vec<D>& c, const Vec<D>& low, const Vec<D>& high) {
    Vec<D> x;
    for (int i = 0; i < D; ++i)
        x[i] = c[i] > 0 ? high[i] : c[i] < 0 ? low[i] : std::clamp(0.0, low[i], high[i]);
    return x;
}

template <int D>
int largest_component(const Vec<D>& a) {
    int best = 0;
    for (int i = 1; i < D; ++i)
        if (std::abs(a[i]) > std::abs(a[best])) best = i;
    return best;
}

template <int D>
Vec<D - 1> without(const Vec<D>& a, int dropped) {
    Vec<D - 1> rest;
    for (int i = 0, n = 0; i < D; ++i)
        if (i != dropped) rest[n++] = a[i];
    return rest;
}

/// The optimum on a.x = b of `wall`, whose largest component is eliminated.
template <int D>
Vec<D> climb_on(const Row<D>& wall, std::span<const Row<D>> rows, const Vec<D>& c, const Vec<D>& low,
                const Vec<D>& high) {
    const int p = largest_component<D>(wall.a);
    const Vec<D - 1> wall_rest = without<D>(wall.a, p);
    // x[p] = (b - wall_rest.y) / a[p]
    const auto substitute = [&](const Vec<D>& a, double b) {
        const double factor = a[p] / wall.a[p];
        Row<D - 1> row{without<D>(a, p), b - factor * wall.b};
        for (int i = 0; i < D - 1; ++i) row.a[i] -= factor * wall_rest[i];
        return row;
    };
    std::vector<Row<D - 1>> lower;
    lower.reserve(rows.size() + 2);
    Vec<D> unit{};
    unit[p] = 1;
    lower.push_back(substitute(unit, high[p]));
    unit[p] = -1;
    lower.push_back(substitute(unit, -low[p]));
    for (const Row<D>& row : rows) lower.push_back(substitute(row.a, row.b));
    const Vec<D - 1> y = climb<D - 1>(lower, substitute(c, 0).a, without<D>(low, p), without<D>(high, p));
    Vec<D> x;
    for (int i = 0, n = 0; i < D; ++i)
        if (i != p) x[i] = y[n++];
    x[p] = std::clamp((wall.b - dot<D - 1>(wall_rest, y)) / wall.a[p], low[p], high[p]);
    return x;
}

template <>
Vec<1> climb<1>(std::span<const Row<1>> rows, const Vec<1>& c, const Vec<1>& low, const Vec<1>& high) {
    double least = low[0], most = high[0];
    for (const Row<1>& row : rows) {
        if (row.a[0] > kTolerance) most = std::min(most, row.b / row.a[0]);
        if (row.a[0] < -kTolerance) least = std::max(least, row.b / row.a[0]);
    }
    if (least > most) return {std::clamp(0.5 * (least + most), low[0], high[0])};
    if (std::abs(c[0]) <= kTolerance) return {0.5 * (least + most)};
    return {c[0] > 0 ? most : least};
}

template <int D>
Vec<D> climb(std::span<const Row<D>> rows, const Vec<D>& c, const Vec<D>& low, const Vec<D>& high) {
    Vec<D> x = best_corner<D>(c, low, high);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (dot<D>(rows[i].a, x) <= rows[i].b + kTolerance) continue;
        if (std::abs(rows[i].a[largest_component<D>(rows[i].a)]) <= kTolerance) continue;
        x = climb_on<D>(rows[i], rows.first(i), c, low, high);
    }
    return x;
}

} // namespace

DeepestPoint find_deepest_point(std::span<const HalfSpace> half_spaces, const PointBox& box,
                                std::uint64_t seed) {
    const Point centre = 0.5 * (box.low + box.high), extent = box.high - box.low;
    const double scale = std::max({extent.x, extent.y, extent.z, 1e-300});
    // Variables: x relative to the centre and the depth t; rows t - n.x <= distance of the centre.
    std::vector<Row<4>> rows;
    rows.reserve(half_spaces.size());
    double farthest = 0;
    for (const HalfSpace& h : half_spaces) {
        const double distance = (glm::dot(h.normal, centre) + h.offset) / scale;
        rows.push_back({{-h.normal.x, -h.normal.y, -h.normal.z, 1}, distance});
        farthest = std::max(farthest, std::abs(distance));
    }
    Random random(seed);
    for (std::size_t i = rows.size(); i > 1; --i) std::swap(rows[i - 1], rows[random.below(i)]);
    const Point half = extent * (0.5 / scale);
    const double reach = farthest + 2;
    const Vec<4> x =
        climb<4>(rows, {0, 0, 0, 1}, {-half.x, -half.y, -half.z, -reach}, {half.x, half.y, half.z, reach});
    const Point point = centre + scale * Point(x[0], x[1], x[2]);
    return {point, depth_at(half_spaces, point)};
}

} // namespace hexopt
