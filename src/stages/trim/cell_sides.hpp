#pragma once

#include "core/context.hpp"
#include "domain/surface_queries.hpp"
#include "stages/trim/cell_graph.hpp"
#include "stages/trim/trim.hpp"

namespace hexopt::trimming {

/// Surfaces nearer to one another than this are in contact, in cell sizes: float coordinates of files err by
/// less, and no cell could follow a gap so narrow.
constexpr double kContact_h = 1e-3;

/// Where the cells of a mesh are with respect to a surface.
struct CellSides {
    std::vector<std::uint8_t> cut;    ///< per cell: 1 where the surface touches it
    std::vector<std::uint8_t> inside; ///< per cell: 1 where its centre is inside
    /// Per cell: depth of its centre over the cell's size, positive inside. +-1 for cells that are not cut,
    /// and for those where both sides of the nearest surface are inside.
    std::vector<float> depth_h;
    std::vector<Index> region; ///< per cell: face-connected set of cells not cut; kNoIndex where cut
    Index region_count = 0;
    std::size_t uncertain_cells = 0;
};

Point cell_centre(const HexMesh& mesh, Index cell);
/// Mean edge length in the cell's shortest direction, model units.
double cell_size(const HexMesh& mesh, Index cell);
/// Product of the mean edge lengths in the three directions: exact for boxes.
double cell_volume(const HexMesh& mesh, Index cell);

/// Regions are decided by a few of their cells; where the surface is not closed by all beside it, and where
/// these disagree cell by cell. memory: as in trim().
CellSides find_sides(const HexMesh& mesh, const CellGraph& graph, const SurfaceQueries& queries,
                     Context& context, TrimMemory& memory);

} // namespace hexopt::trimming
