#pragma once

#include "domain/box_tree.hpp"
#include "domain/domain.hpp"

#include <vector>

namespace hexopt {

/// Looks along a ray for the surface on the other side of a gap or wall. Thread-safe.
class GapProbe {
  public:
    explicit GapProbe(const Domain& domain);

    /// Distance from `from` along the unit vector `direction` to the nearest triangle whose outward normal
    /// points within 30 degrees against `normal`; `reach` if there is none before. What is nearer than a
    /// billionth of the diagonal does not count (sheets that lie on one another).
    double distance(const Point& from, const Point& direction, const Point& normal, double reach) const;

  private:
    struct Triangle {
        Point origin, edge1, edge2, normal;
    };
    std::vector<Triangle> triangles_; ///< in the order of the tree's leaves
    BoxTree tree_;
    Index root_ = kNoIndex;
    double nearest_ = 0;
};

} // namespace hexopt
