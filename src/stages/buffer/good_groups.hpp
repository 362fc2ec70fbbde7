#pragma once

#include "stages/buffer/buffer.hpp"
#include "stages/buffer/sheet_mesh.hpp"

namespace hexopt {

/// Per group of regions (`group` numbers them from 0, per region) 1 where it is best left without layers: no
/// quad of it is flat, no cell has two faces on one region, along its ridges there is a cell for each right
/// angle within 45 degrees, and no cell at it is below BufferOptions::enough_sj. No layer can better such a
/// lattice along flat walls, and at concave ridges it would spoil it. None with the thesis's method.
std::vector<std::uint8_t> find_good_groups(const SheetMesh& mesh, const std::vector<Index>& group,
                                           const Domain& domain, const BufferOptions& options,
                                           const Parallel& parallel);

} // namespace hexopt
