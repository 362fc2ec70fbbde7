#pragma once

#include "core/parallel.hpp"
#include "mesh/hex_mesh.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// Cells with a non-positive one of all 32 tetrahedra, rising.
std::vector<Index> find_bad_cells(const HexMesh& mesh, std::span<const Point> positions,
                                  const Parallel& parallel);

/// Cells that are bad or have a scaled Jacobian below min_sj at a corner, rising.
std::vector<Index> find_flat_cells(const HexMesh& mesh, std::span<const Point> positions, double min_sj,
                                   const Parallel& parallel);

/// Cells that are bad or whose mean shape energy over the 32 tetrahedra, against their own mean edge and
/// stretch (HexGroup::inverse_stretch; empty: cubes), exceeds `energy` (1 for the ideal cell), rising.
std::vector<Index> find_poor_cells(const HexMesh& mesh, std::span<const Point> positions,
                                   std::span<const float> inverse_stretch, double energy,
                                   const Parallel& parallel);

/// Sum over the cells of the mean shape energy of their 32 tetrahedra, as find_poor_cells() measures it.
double sum_of_energy(const HexMesh& mesh, std::span<const Point> positions,
                     std::span<const float> inverse_stretch, const Parallel& parallel);

/// Target lengths over their geometric mean, inverted: HexGroup::inverse_stretch.
std::vector<float> inverse_stretches(std::span<const std::array<double, 3>> lengths);

} // namespace hexopt
