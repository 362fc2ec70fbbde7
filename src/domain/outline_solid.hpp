#pragma once

#include "core/result.hpp"
#include "domain/slab_planes.hpp"
#include "mesh/outline.hpp"
#include "mesh/triangle_soup.hpp"

#include <optional>
#include <string>

namespace hexopt {

/// A region of the plane between two parallel planes.
struct Slab {
    Outline outline;                                    ///< in the low plane
    double low = 0, high = 1;                           ///< third coordinates in its frame
    std::string low_name = "back", high_name = "front"; ///< of the plane sides

    /// A point of an outline in a turned frame, and the vertices of the surface there, which are off it by
    /// rounding.
    struct GivenPoint {
        Point2 at;
        Point low, high; ///< in the model
    };
    std::vector<GivenPoint> given = {}; ///< by rising x, then y; empty where the frame is not turned
};

/// The slab's surface in its frame, closed, pointing outwards. Its patches: those of the outline, then
/// low_name and high_name. Error (bad_input): loops that cross or touch.
Result<TriangleSoup> make_solid(const Slab& slab);

/// The slab that a surface is: all its vertices lie in two planes (find_slab_planes(), the first that do; at
/// most `most_rel` of the diagonal apart), and its sides join equal outlines in both. Names of patches are
/// kept; those of the plane sides where these are patches of their own. Vertices must be merged
/// (weld_surface()). An error (bad_input) says why it is none.
Result<Slab> recognise_slab(const TriangleSoup& surface,
                            double most_rel = std::numeric_limits<double>::infinity());

/// From the slab's frame to the model's, at the points of the outline to the surface's own vertices: the
/// first half of `positions` lies in the low plane, the other above it.
void place_in_model(const Slab& slab, std::vector<Point>& positions);

} // namespace hexopt
