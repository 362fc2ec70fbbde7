#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

#include <span>

namespace hexopt {

/// What bounds the parts that seeds lie in.
struct SeededSurface {
    TriangleSoup soup;               ///< patches and names as given; vertices that are used
    std::size_t left_out_bodies = 0; ///< closed surfaces that bound none of these parts
};

/// Leaves out closed surfaces that do not bound what the seeds lie in: other bodies, what is inside cavities,
/// and where a seed lies in a cavity what is round it. So the surface that holds a seed becomes an outer one,
/// and all that is left is what the mesh is to lie on. Surfaces that cross one another stay together; those
/// that are not closed stay. All stays where a seed is inside nothing: it tells of a leak later. Triangles
/// may point either way. Errors: bad_input (an id out of range, a coordinate that is not finite), cancelled.
Result<SeededSurface> keep_around_seeds(TriangleSoup soup, std::span<const Point> seeds, Context& context);

} // namespace hexopt
