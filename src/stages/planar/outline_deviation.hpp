#pragma once

#include "core/parallel.hpp"
#include "domain/deviation.hpp"
#include "stages/planar/quad_mesh.hpp"

namespace hexopt {

/// How far the boundary of an extruded mesh and the slab of the outlines are apart: as far as their outlines,
/// since the planes are the same. From the outlines to the mesh exactly, at their points; the other way at 15
/// places an edge, bounded above by how far the edge's part of the outline leaves it. The rims are the
/// curves. DirectedDeviation::element: an edge of mesh.wall, or a segment of the outlines.
Deviation measure_outline_deviation(const QuadMesh& mesh, const OutlineCurves& curves,
                                    const Parallel& parallel);

/// Edges of mesh.wall that cross or touch others than their neighbours, rising. The quads of extrude()'s
/// walls have the same numbers.
std::vector<Index> find_wall_contacts(const QuadMesh& mesh);

} // namespace hexopt
