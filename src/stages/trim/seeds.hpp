#pragma once

#include "core/result.hpp"
#include "domain/surface_queries.hpp"
#include "stages/trim/cell_sides.hpp"

namespace hexopt::trimming {

/// Cells that hold the seeds. Error (bad_input): a seed outside the mesh.
Result<std::vector<Index>> find_seed_cells(const HexMesh& mesh, std::span<const Point> seeds);

/// The winding numbers of what the seeds are in: the inside, or where all are on another side of the surface
/// that side. Error (bad_input): they are on different sides, or outside of everything.
Result<WindingRange> choose_side(const SurfaceQueries& queries, std::span<const Point> seeds);

/// Shortest path over faces from a cell through cells for which `open` holds to one on the mesh's own
/// boundary for which `is_outside` holds; empty where there is none.
std::vector<Index> find_path_outside(const CellGraph& graph, Index from, std::span<const std::uint8_t> open,
                                     std::span<const std::uint8_t> is_outside);

} // namespace hexopt::trimming
