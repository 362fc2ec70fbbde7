#pragma once

#include "core/types.hpp"

#include <array>
#include <glm/geometric.hpp>

namespace hexopt {

/// Closest point of a triangle or segment with the weights of its corners.
template <std::size_t N>
struct ClosestPoint {
    Point point;
    std::array<double, N> weight; ///< non-negative, sum 1
};

/// Closest point of the segment from a to b; an end is returned exactly. A segment of length 0 is its first
/// end.
inline ClosestPoint<2> closest_on_segment(const Point& p, const Point& a, const Point& b) {
    const Point d = b - a;
    const double along = glm::dot(p - a, d), length2 = glm::dot(d, d);
    if (!(along > 0)) return {a, {1, 0}};
    if (along >= length2) return {b, {0, 1}};
    const double t = along / length2;
    return {a + t * d, {1 - t, t}};
}

/// Closest point of triangle abc, by the Voronoi regions of its features; corners are returned exactly.
/// Triangles without area are treated as their edges. Source: Ericson, Real-Time Collision Detection, 5.1.5.
ClosestPoint<3> closest_on_triangle(const Point& p, const Point& a, const Point& b, const Point& c);

} // namespace hexopt
