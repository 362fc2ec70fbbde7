#pragma once

#include "domain/surface_polygons.hpp"

#include <map>
#include <set>

namespace hexopt {

/// How far a surface turns beside lines on it.
class TurnBeside {
  public:
    using Edge = std::array<Index, 2>; ///< vertices, smaller first

    /// lines: edges at which the walks over the surface stop. Both outlive this.
    TurnBeside(const CleanSurface& surface, const std::set<Edge>& lines);

    /// Degrees by which the surface's normal differs at most from the one at an edge, on each of its two
    /// sides, among triangles that can be walked to within `reach` (model units) of p. 0 where the edge has
    /// not two triangles.
    std::array<double, 2> turn_deg(const Edge& edge, const Point& p, double reach) const;

  private:
    double walk(Index triangle, const Point& normal, const Point& p, double reach) const;
    double distance(Index triangle, const Point& p) const;

    const CleanSurface& surface_;
    const std::set<Edge>& lines_;
    std::map<Edge, std::vector<Index>> beside_;
};

} // namespace hexopt
