#pragma once

#include "stages/fit/curve_net.hpp"
#include "stages/fit/surface_mesh.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt::fit {

/// Arc lengths along the leg for the vertices of a path (two at least), rising from ends[0] to ends[1]: near
/// each vertex's closest point, with steps in proportion to the edges there, such that none overtakes
/// another. placed: positions by the surface's numbers.
std::vector<double> spread_path(const Leg& leg, std::array<double, 2> ends, std::span<const Index> path,
                                const SurfaceMesh& surface, std::span<const Point> placed);

} // namespace hexopt::fit
