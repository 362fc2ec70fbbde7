#pragma once

#include "core/types.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace hexopt {

/// The points x with dot(normal, x) + offset >= 0.
struct HalfSpace {
    Point normal;
    double offset;
};

struct PointBox {
    Point low, high;
};

/// Scales every half-space so that its normal is a unit vector and the offset a distance. Half-spaces whose
/// normal is below `tiny` are left out: no motion changes them.
std::vector<HalfSpace> normalised(std::span<const HalfSpace> half_spaces, double tiny);

/// Least signed distance of a point to the planes of normalised half-spaces: > 0 strictly inside all.
double depth_at(std::span<const HalfSpace> half_spaces, const Point& point);

/// Mean of the extreme points of the kernel, i.e. the intersection of the half-spaces and the box, along the
/// six axis directions (4.11), or along those and the twenty diagonal ones (4.12). Found by the simplex
/// method, shifted to the box's low corner so that coordinates are not negative. May lie on the kernel's
/// boundary (depth_at tells). None: the kernel is empty. half_spaces: normalised. Source: thesis 4.2.4.
std::optional<Point> average_extremes(std::span<const HalfSpace> half_spaces, const PointBox& box,
                                      bool extended);

struct DeepestPoint {
    Point point;
    double depth; ///< its least distance to a plane, model units; > 0 iff the kernel has an interior
};

/// The point of the box whose least signed distance to the planes is largest: the centre of the largest ball
/// in the kernel, or the point that misses it least. half_spaces: normalised; the box: not empty. The answer
/// depends on the seed only where several points are equally deep. Source: Seidel 1991, "Small-dimensional
/// linear programming and convex hulls made easy".
DeepestPoint find_deepest_point(std::span<const HalfSpace> half_spaces, const PointBox& box,
                                std::uint64_t seed);

} // namespace hexopt
