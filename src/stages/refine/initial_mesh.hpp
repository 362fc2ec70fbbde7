#pragma once

#include "stages/refine/refine.hpp"

namespace hexopt {

/// A box of hexahedra. positions i + (n+1)(j + (m+1)k).
HexMesh make_box_mesh(const Box& box, const std::array<Index, 3>& cells);

/// Box round `surface` of cells of about `fine_size` * 2^levels such that the surface's extreme planes lie
/// inside the cells of size `fine_size`, never on a grid plane. At least `margin` fine cells stay around the
/// surface. planar: one cell along z that ends a margin outside of the surface.
HexMesh make_padded_box(const Box& surface, double fine_size, int levels, int margin, bool planar);

} // namespace hexopt
