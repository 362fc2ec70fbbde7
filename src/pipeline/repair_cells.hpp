#pragma once

#include "mesh/hex_mesh.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Cells of `octree` that hold a vertex of one of the named cells of `mesh`, or lie round such a cell at most
/// `rings` vertex neighbours away. Ascending, each once. Both meshes in the same coordinates; vertices of
/// `mesh` that have left the octree find none.
std::vector<Index> find_cells_round(const HexMesh& octree, const HexMesh& mesh, std::span<const Index> cells,
                                    int rings);

} // namespace hexopt
