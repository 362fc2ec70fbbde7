#pragma once

#include "stages/trim/kept_cells.hpp"

namespace hexopt::trimming {

/// Where the surface has no kept cells beside it.
struct Coverage {
    double area = 0; ///< of the surface in the cells, model units squared
    double bare_area = 0;
    std::vector<BareSpot> spots; ///< one a cell and side of the surface, by rising cell
    std::vector<BarePart> parts; ///< of the spots
};

/// Looks at each cell that the surface cuts: what points the same way in it counts as covered where the
/// boundary of the kept cells has a face that points that way, too, within a cell along the face's normal and
/// less than half a cell beside it. What is known of the surface in a cell by its key is not looked for
/// again, and what is found out goes there.
Coverage measure_coverage(const HexMesh& mesh, const CellGraph& graph, const CellSides& sides,
                          const KeptCells& kept, const SurfaceQueries& queries, std::span<const Index> key,
                          const Parallel& parallel, SurfaceSides& known);

} // namespace hexopt::trimming
