#pragma once

#include "core/parallel.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/hex_mesh.hpp"

#include <span>

namespace hexopt {

/// How much of quads and of a surface lies within a tenth of the quads' size of one another: the percentage,
/// 0..100, of the area of both together, by places spread evenly, 5 on a quad and about 4 for each quad on
/// the surface, one in each of its triangles at least. The size is the mean edge of the quad that the place
/// lies on or that is nearest to it. quads: of `positions`; quad_surface: the same as a surface, whose
/// source_face() is a place in `quads`. Same result for any number of threads.
double percentage_within_tenth(std::span<const Point> positions, std::span<const Quad> quads,
                               const BoundaryModel& surface, const BoundaryModel& quad_surface,
                               const Parallel& parallel);

} // namespace hexopt
