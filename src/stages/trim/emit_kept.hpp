#pragma once

#include "core/result.hpp"
#include "stages/trim/cell_graph.hpp"

#include <span>

namespace hexopt::trimming {

/// The mesh of the kept cells: vertices in the octree's order, hanging where a kept cell has them on an edge
/// or face. `kept_cell` gets the octree's number of each cell. Error (bad_input): constraints that cannot be
/// closed.
Result<HexMesh> emit_kept(const HexMesh& octree, const CellGraph& graph, std::span<const std::uint8_t> kept,
                          std::vector<Index>& kept_cell);

} // namespace hexopt::trimming
