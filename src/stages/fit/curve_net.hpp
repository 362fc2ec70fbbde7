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
    std::vector<std::array<Index, 2>> curve_legs; ///< per curve: [first, last); none where it is too small
    std::vector<std::uint8_t> too_small;          ///< per curve
    std::vector<std::uint8_t> one_edge;           ///< per leg: a whole short curve that one edge is to follow
};

/// What is too small for the cells: curves that become a point, and the corner that stands for each corner.
struct SmallFeatures {
    std::vector<Index> corner;           ///< per corner: itself, or the one that stands for it
    std::vector<std::uint8_t> too_small; ///< per curve
    std::vector<std::uint8_t> one_edge;  ///< per curve: short, but across the end of a thin wall or gap
};

/// Finds corners within a cell of one another that short curves join (below half a cell; the sharpest of them
/// stands for all), and short curves that end inside a patch (below 0.8 cells from a corner of others, 1.2
/// cells on their own). Sharp short curves between two corners without another one stay, as the mesh has an
/// edge across the end of a wall or gap however thin that is; not those of `as_points` (rising). cell_size:
/// per corner, model units.
SmallFeatures find_small_features(const Domain& domain, std::span<const double> cell_size,
                                  std::span<const Index> as_points = {});

CurveNet make_curve_net(const Domain& domain, const SmallFeatures& small);

/// Point of a leg at an arc length (clamped).
Point point_at(const Leg& leg, double arc_length);

/// Arc length of the leg's closest point to `query`.
double closest_arc_length(const Leg& leg, const Point& query);

/// Distance of `query` from leg number `leg`, model units. A curve of several legs comes near itself: a path
/// that were measured by the whole of it could go the other way round.
double distance_from_leg(const CurveNet& net, Index leg, const BoundaryModel& model, const Point& query);

} // namespace hexopt::fit
