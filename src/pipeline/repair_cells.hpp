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

/// Raises what `level` (per vertex of `octree`; -1: none) says of a cell's vertices to the cell's level.
void mark_vertices(const HexMesh& octree, Index cell, std::vector<int>& level);

/// Cells at vertices that are marked by a level, no finer than that. Ascending.
std::vector<Index> find_marked(const HexMesh& octree, const std::vector<int>& level);

/// The named cells and those round them, over vertices, that are no smaller. Ascending, each once.
std::vector<Index> add_ring(const HexMesh& octree, std::span<const Index> cells);

} // namespace hexopt
