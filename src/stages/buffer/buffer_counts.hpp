#pragma once

#include "stages/buffer/buffer.hpp"
#include "stages/buffer/surface_regions.hpp"

namespace hexopt {

/// Places of flat quads in mesh.surface.
std::vector<Index> find_flat_quads(const SheetMesh& mesh);

/// Places in mesh.surface of quads of cells with two faces on one region, joined at an edge that is no ridge.
std::vector<Index> find_two_face_quads(const SheetMesh& mesh);

/// Places of quads that are alone in a corner of their region sharper than `corner_deg`, one of whose two
/// ridges reaches `join_deg`.
std::vector<Index> find_sharp_corner_quads(const SheetMesh& mesh, const Domain& domain, double corner_deg,
                                           double join_deg);

/// How many cells have each of mesh.ridges.
std::vector<std::size_t> count_ridge_cells(const SheetMesh& mesh);

BufferCounts count_for_buffers(const SheetMesh& mesh, const Domain& domain);

} // namespace hexopt
