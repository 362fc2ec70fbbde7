#pragma once

#include "domain/domain.hpp"

#include <span>
#include <vector>

namespace hexopt::fit {

/// A place of the surface that one mesh vertex is to take: a corner, or a way point that cuts a closed curve.
struct Anchor {
    Point place;
    Index corner; ///< kNoIndex: a way point
    Index curve;  ///< of a way point; kNoIndex for a corner
};

/// A piece of a curve between two anchors; what a path of mesh edges is sought for.
struct Leg {
    Index curve;
    std::array<Index, 2> anchor;
    std::vector<Point> points;      ///< first and last: at the anchors
    std::vector<double> arc_length; ///< of each point from the first, model units
    double length() const { return arc_length.back(); }
};

/// Curves cut into legs. Those that come back to where they start, or nearly so, get way points of equal arc:
/// four without a corner, else three.
struct CurveNet {
    std::vector<Anchor> anchors;                  ///< corners first, by number
    std::vector<Leg> legs;                        ///< by curve, in the curve's direction
    Csr<Index> anchor_leg;                        ///< legs at each anchor that are to be captured, rising
    std::vector<std::array<Index, 2>> curve_legs; ///< per curve: [first, last)
};

CurveNet make_curve_net(const Domain& domain);

/// Point of a leg at an arc length (clamped).
Point point_at(const Leg& leg, double arc_length);

/// Arc length of the leg's closest point to `query`.
double closest_arc_length(const Leg& leg, const Point& query);

} // namespace hexopt::fit
