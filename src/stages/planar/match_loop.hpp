#pragma once

#include "stages/planar/trim_quads.hpp"

#include <vector>

namespace hexopt {

/// How many cells of the mesh meet at a corner of the outline: as many as make their angles nearest to right
/// ones (1 up to 120 degrees, 2 up to 216, 3 up to 309, else 4).
int cells_at_corner(double angle_deg);

/// A vertex of the outline in the making: the edge from kept vertex `position` (place in KeptLoop::vertices)
/// to the outline at s. Corners with 3 and 4 cells take two and four more edges of the kept loop and have an
/// edge to the kept vertex after every second.
struct WallLink {
    Index position;
    double s;
    Index corner = kNoIndex; ///< in OutlineCurves::corners() of the loop
    int cells = 2;
    /// Edges of the kept loop that the link itself takes.
    Index span() const { return cells > 2 ? 2 * static_cast<Index>(cells - 2) : 0; }
};

/// Joins the vertices of a kept loop, in order, to places along its outline, in order, such that every corner
/// has one: the shortest way in sum of squares (dynamic programming over samples of the outline). Links by
/// rising position and s; s of the last ones may go beyond the length. Empty: there is none, the loop has too
/// few edges.
std::vector<WallLink> match_loop(const KeptLoop& loop, const std::vector<Point2>& positions,
                                 const OutlineCurves& curves);

} // namespace hexopt
