#pragma once

#include "core/result.hpp"
#include "mesh/outline.hpp"
#include "mesh/triangle_soup.hpp"

#include <optional>
#include <string>

namespace hexopt {

/// A region of the plane between two planes of constant z.
struct Slab {
    Outline outline;
    double low = 0, high = 1;                           ///< z
    std::string low_name = "back", high_name = "front"; ///< of the plane sides
};

/// The slab's surface, closed, pointing outwards. Its patches: those of the outline, then low_name and
/// high_name. Error (bad_input): loops that cross or touch.
Result<TriangleSoup> make_solid(const Slab& slab);

/// The slab that a surface is: all its vertices lie in two planes of constant z, and its sides join equal
/// outlines in both. Names of patches are kept; those of the plane sides where these are patches of their
/// own. Vertices must be merged (weld_surface()). An error (bad_input) says why it is none.
Result<Slab> recognise_slab(const TriangleSoup& surface);

} // namespace hexopt
