#pragma once

#include "stages/trim/kept_cells.hpp"

namespace hexopt::trimming {

/// Joins the cells of bare spots (by rising cell) that touch, sets the spots' part, and tells how far each
/// part goes on away from the kept cells.
std::vector<BarePart> join_bare_spots(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                                      std::vector<BareSpot>& spots);

} // namespace hexopt::trimming
