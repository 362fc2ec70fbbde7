#pragma once

#include "stages/fit/curve_net.hpp"
#include "stages/fit/surface_mesh.hpp"

#include <functional>
#include <span>
#include <vector>

namespace hexopt::fit {

/// The legs round an anchor, counter-clockwise seen from outside, and the angles of the surface between them.
struct CornerFan {
    std::vector<Index> leg;        ///< empty: not known
    std::vector<double> angle_deg; ///< from leg k to leg k + 1, the last to the first
};

/// Per anchor: from the triangles that meet there; way points have two halves of 180 degrees. Not known where
/// triangles do not match along a leg, where several legs begin alike, and for legs that end alone.
std::vector<CornerFan> find_corner_fans(const Domain& domain, const CurveNet& net);

/// A first edge for each of an anchor's legs at a vertex.
struct RingChoice {
    std::vector<Index> neighbour; ///< per leg of net.anchor_leg[anchor]; empty: no choice
    double sectors = 0;           ///< by how much the numbers of quads between them differ from the angles
};

/// Looks for the choice with the least sum of squared angles (radians) between legs and edges, of what
/// `extra` says for an edge to a neighbour and a leg, and of what the numbers of quads between the edges
/// cost: the squared logarithm of the angle for each, in units of 90 degrees.
class RingChooser {
  public:
    RingChooser(const SurfaceMesh& surface, const std::vector<Point>& placed, const CurveNet& net,
                const std::vector<CornerFan>& fans);
    RingChoice choose(Index anchor, Index vertex,
                      const std::function<double(Index neighbour, Index leg)>& extra) const;

  private:
    const SurfaceMesh& surface_;
    const std::vector<Point>& placed_;
    const CurveNet& net_;
    const std::vector<CornerFan>& fans_;
};

} // namespace hexopt::fit
