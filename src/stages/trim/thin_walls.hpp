#pragma once

#include "stages/trim/cell_graph.hpp"
#include "stages/trim/cell_sides.hpp"
#include "stages/trim/kept_cells.hpp"

namespace hexopt::trimming {

/// A cell that the middle of a thin wall goes through.
struct WallCell {
    Index cell;
    Point middle;     ///< a point of the wall's middle in or near the cell
    Point normal;     ///< of the wall there, unit
    double thickness; ///< model units
};

/// Cells at bare spots that the surface half-way between the two sides of a wall goes through, where the wall
/// is thinner than 1.8 cells and not thinner than `thinnest_h` (> 0). Kept they are a closed layer
/// one or two cells thick all over the wall: of a plane all cells that it meets are face-connected round
/// every vertex, and so are the others on either side of it. Rising.
std::vector<WallCell> find_wall_cells(const HexMesh& mesh, const CellGraph& graph, const CellSides& sides,
                                      const KeptCells& kept, const SurfaceQueries& queries,
                                      const std::vector<BareSpot>& spots, double thinnest_h,
                                      const Parallel& parallel);

/// Removes from the list face-connected sets of wall cells of which mending has dropped more than a quarter:
/// their ends have no surface to lie on. Number of cells removed.
std::size_t drop_frayed_walls(const CellGraph& graph, const KeptCells& kept, std::vector<WallCell>& walls);

/// Adds to `cells` (rising) what is face-connected with them in a layer one cell thick, over cells no
/// smaller: a front between levels that leaves half faces there would only move on by a cell.
void spread_over_layers(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                        std::vector<Index>& cells);

} // namespace hexopt::trimming
