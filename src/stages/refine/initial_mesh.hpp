#pragma once

#include "stages/refine/refine.hpp"

namespace hexopt {

/// A box of n × m × l equal hexahedra; vertex (i, j, k) is i + (n+1)(j + (m+1)k).
HexMesh make_box_mesh(const Box& box, const std::array<Index, 3>& cells);

/// The initial mesh of a run whose cells on the surface are to have a size. Errors (usage): a box without
/// volume, counts along some axes only, a surface without extent.
Result<HexMesh> make_initial_mesh(const Domain& domain, const RefineOptions& options, const TargetSize& size);

/// A first guess of the surface's size for a number of cells; 0 where the surface has no extent.
double first_size(const Domain& domain, double cells, bool planar);

} // namespace hexopt
