#pragma once

#include "core/parallel.hpp"
#include "stages/planar/quad_mesh.hpp"

namespace hexopt {

/// Least sine of the angles at the corners of a quad, -1..1, negative where it is concave or turned over: the
/// scaled Jacobian of the hexahedron that it becomes.
double quad_scaled_jacobian(const QuadMesh& mesh, std::size_t quad);

struct QuadQuality {
    double smallest = 1;      ///< scaled Jacobian
    std::size_t inverted = 0; ///< quads at or below 0
};
QuadQuality measure_quads(const QuadMesh& mesh, const Parallel& parallel);

} // namespace hexopt
