#include "stages/optimize/lp_kernel.hpp"
#include "stages/optimize/lp_simplex.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kTolerance = 1e-11;

/// (4.11), then (4.12).
constexpr std::array<std::array<int, 3>, 26> kTargets = [] {
    std::array<std::array<int, 3>, 26> target{};
    int n = 0;
    for (int nonzero = 1; nonzero <= 3; ++nonzero)
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z)
                    if (x * x + y * y + z * z == nonzero) target[n++] = {x, y, z};
    return target;
}();

} // namespace

std::vector<HalfSpace> normalised(std::span<const HalfSpace> half_spaces, double tiny) {
    std::vector<HalfSpace> unit;
    unit.reserve(half_spaces.size());
    for (const HalfSpace& h : half_spaces)
        if (const double length = glm::length(h.normal); length > tiny)
            unit.push_back({h.normal / length, h.offset / length});
    return unit;
}

double depth_at(std::span<const HalfSpace> half_spaces, const Point& point) {
    double depth = std::numeric_limits<double>::infinity();
    for (const HalfSpace& h : half_spaces) depth = std::min(depth, glm::dot(h.normal, point) + h.offset);
    return depth;
}

std::optional<Point> average_extremes(std::span<const HalfSpace> half_spaces, const PointBox& box,
                                      bool extended) {
    const Point extent = box.high - box.low;
    const double scale = std::max({extent.x, extent.y, extent.z});
    if (!(scale > 0)) return std::nullopt;
    Simplex<double> simplex(3, kTolerance);
    for (int axis = 0; axis < 3; ++axis) {
        std::array<double, 3> row{};
        row[axis] = 1;
        simplex.add_row(row, extent[axis] / scale);
    }
    for (const HalfSpace& h : half_spaces)
        simplex.add_row(std::array{-h.normal.x, -h.normal.y, -h.normal.z},
                        (glm::dot(h.normal, box.low) + h.offset) / scale);
    if (!simplex.find_feasible()) return std::nullopt;
    const int count = extended ? 26 : 6;
    Point sum(0);
    for (int n = 0; n < count; ++n) {
        const std::array<double, 3> target = {double(kTargets[n][0]), double(kTargets[n][1]),
                                              double(kTargets[n][2])};
        if (!simplex.maximise(target)) return std::nullopt;
        const auto x = simplex.solution();
        sum += Point(x[0], x[1], x[2]);
    }
    return box.low + sum * (scale / count);
}

} // namespace hexopt
