#pragma once

#include "domain/box_tree.hpp"

#include <array>

namespace hexopt {

/// The part of a triangle inside a box: weights of its corners at the polygon's vertices. At most 9.
struct ClippedTriangle {
    std::array<std::array<double, 3>, 9> weight;
    int count = 0;
};
ClippedTriangle clip_triangle(const std::array<Point, 3>& triangle, const Box& box);

} // namespace hexopt
