#pragma once

#include "stages/refine/criteria.hpp"

namespace hexopt {

/// The regions of a run. Thread-safe.
class Regions {
  public:
    /// Errors (usage): a region without extent or target, an unknown patch.
    static Result<Regions> create(const Domain& domain, const RefineOptions& options);

    bool empty() const { return regions_.empty(); }
    /// Whether a cell that may meet a region is larger than it allows. Conservative: the cell counts as the
    /// ball round its bounding box.
    bool wants_split(const CellRefinement& refinement, Index node, AxisMask mask) const;

    /// Whether some region has sizes of its own along each axis.
    bool has_axes() const;
    /// Axes along which a cell is larger than such regions allow.
    AxisMask axes_to_split(const CellRefinement& refinement, Index node) const;

  private:
    struct Region {
        RegionTarget target;
        Goal goal;
        std::vector<Index> patches; ///< RegionShape::patch
    };
    Regions(const Domain& domain, const PlaneFrame& frame) : domain_(&domain), frame_(frame) {}
    /// Whether the region or what is within its distance comes within `half` of a point of the domain.
    bool may_meet(const Region& region, const Point& at, double half) const;
    double distance(const Region& region, const Point& at, double reach) const;

    const Domain* domain_;
    PlaneFrame frame_; ///< of the domain in the model, in whose coordinates regions are
    std::vector<Region> regions_;
};

} // namespace hexopt
