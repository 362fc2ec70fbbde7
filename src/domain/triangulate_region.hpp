#pragma once

#include "core/result.hpp"
#include "mesh/outline.hpp"

#include <array>
#include <vector>

namespace hexopt {

/// Triangles that fill what lies inside an odd number of closed loops, as indices into the points of the
/// first loop, then of the second, ...; counter-clockwise. Constrained Delaunay; no point is added. Error
/// (bad_input): loops that cross or touch.
Result<std::vector<std::array<Index, 3>>> triangulate_region(const std::vector<std::vector<Point2>>& loops);

} // namespace hexopt
