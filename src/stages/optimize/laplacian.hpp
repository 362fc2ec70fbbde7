#pragma once

#include "stages/optimize/local_energy.hpp"

namespace hexopt {

/// Mean of a vertex's neighbours along the edges of its cells, weighted with the reciprocals of the edges'
/// target lengths (an edge's target: the mean of its cells'). Each neighbour counts once. The vertex itself
/// where it has no cells. Source: thesis 4.4.
Point laplacian_point(const HexMesh& mesh, const Topology& topology, std::span<const Point> positions,
                      const CellTargets& targets, Index vertex);

} // namespace hexopt
