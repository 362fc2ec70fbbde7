#pragma once

#include "mesh/plane_frame.hpp"
#include "mesh/triangle_soup.hpp"

#include <limits>
#include <vector>

namespace hexopt {

/// How far vertices of a slab may be off its planes, as a fraction of its diagonal: what is left of
/// coordinates that were turned and rounded to floats.
inline constexpr double kSlabRounding_rel = 1e-6;

/// Two parallel planes that all vertices of a surface lie in.
struct SlabPlanes {
    PlaneFrame frame;
    double low = 0, high = 1; ///< third coordinates in the frame
};

/// Pairs of planes, at most so far apart (as a fraction of the diagonal) and farther than rounding, that hold
/// all vertices of the surface's triangles: those thinner than a twentieth of the diagonal before others,
/// of these planes of constant x, y or z before turned ones, then by distance (z, x, y where it is equal).
/// The first direction in a turned plane is that of the longest edge that walls end in. Serial.
std::vector<SlabPlanes> find_slab_planes(const TriangleSoup& surface,
                                         double most_rel = std::numeric_limits<double>::infinity());

/// Thickness of slabs that are taken for one without being told, as a fraction of the diagonal.
inline constexpr double kThinSlab_rel = 0.05;

} // namespace hexopt
