#pragma once

#include "core/parallel.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <span>

namespace hexopt {

/// Takes vertices back from where a step moved them (mesh.positions) to where they were (before, one a
/// vertex), as few rings round the boundary quads that touch others and did not before as it needs for none
/// of them to be left, and no cell to be worse than before and after the step and than the scaled Jacobian
/// min_sj (-1..1). Returns how many vertices went back.
std::size_t undo_contacts(HexMesh& mesh, const Topology& topology, std::span<const Point> before,
                          double min_sj, const Parallel& parallel);

} // namespace hexopt
