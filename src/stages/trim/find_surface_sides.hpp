#pragma once

#include "stages/trim/cell_sides.hpp"

namespace hexopt::trimming {

/// Finds the sides of the surface in those cells that it cuts and of which they are not known. key: of each
/// cell, as in TrimMemory.
void find_surface_sides(const HexMesh& mesh, const CellSides& sides, std::span<const Index> key,
                        const SurfaceQueries& queries, const Parallel& parallel, SurfaceSides& known);

} // namespace hexopt::trimming
