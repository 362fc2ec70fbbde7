#pragma once

#include "core/parallel.hpp"
#include "mesh/hex_mesh.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Cells with a non-positive one of all 32 tetrahedra, rising.
std::vector<Index> find_bad_cells(const HexMesh& mesh, std::span<const Point> positions,
                                  const Parallel& parallel);

/// Cells that are bad or whose mean shape energy over the 32 tetrahedra, against their own mean edge,
/// exceeds `energy` (1 for a cube), rising.
std::vector<Index> find_poor_cells(const HexMesh& mesh, std::span<const Point> positions, double energy,
                                   const Parallel& parallel);

} // namespace hexopt
