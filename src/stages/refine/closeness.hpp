#pragma once

#include "domain/box_tree.hpp"
#include "domain/domain.hpp"

#include <vector>

namespace hexopt {

/// How small the pieces of a domain's topology are, and how near curves are to others: what has to be
/// resolved by a few cells for the topology to be captured. Thread-safe.
class Closeness {
  public:
    explicit Closeness(const Domain& domain);

    /// Width of a patch, model units: the shorter side of the rectangle with its area and perimeter, or the
    /// side of a square of its area where it is rounder than that.
    double patch_width(Index patch) const { return patch_width_[patch]; }
    /// Length of a curve; a third of it for a closed one, which needs more edges.
    double curve_length(Index curve) const { return curve_length_[curve]; }
    /// Distance from a point on a curve to the nearest other curve that shares no corner with it; `reach` if
    /// there is none nearer. What is nearer than a billionth of the diagonal does not count.
    double other_curve(Index curve, const Point& from, double reach) const;

  private:
    bool are_neighbours(Index a, Index b) const;

    const Domain& domain_;
    std::vector<double> patch_width_, curve_length_;
    BoxTree tree_; ///< of segments
    Index root_ = kNoIndex;
    std::vector<Index> order_;
};

} // namespace hexopt
