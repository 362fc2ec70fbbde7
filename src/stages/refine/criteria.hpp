#pragma once

#include "stages/refine/refine.hpp"
#include "stages/refine/surface_elements.hpp"

namespace hexopt {

/// A size or a level that cells are to reach; neither: nothing is asked for.
struct Goal {
    double size = 0;
    int level = -1;

    bool wants_split(double cell_size, int depth) const {
        return level >= 0 ? depth < level : size > 0 && cell_size > size * (1 + 1e-6);
    }
};

/// The criteria that look at a cell and the surface in it. Thread-safe.
class SurfaceCriteria {
  public:
    /// Errors (usage): a patch that the domain does not have.
    static Result<SurfaceCriteria> create(const Domain& domain, const RefineOptions& options,
                                          const TargetSize& surface);

    /// The first criterion by which a cell is to be split, RefineCriterion::count if none.
    RefineCriterion ask(const CellRefinement& refinement, Index node, std::span<const Index> elements,
                        const SurfaceElements& surface) const;

    /// Largest angle between the interpolated normals of one patch inside a box, degrees.
    double normal_spread_deg(const Box& box, std::span<const Index> elements,
                             const SurfaceElements& surface) const;

  private:
    explicit SurfaceCriteria(const Domain& domain) : domain_(domain) {}
    bool wants_size(const CellRefinement& refinement, Index node, std::span<const Index> elements,
                    const SurfaceElements& surface) const;
    bool wants_normals(const CellRefinement& refinement, Index node, std::span<const Index> elements,
                       const SurfaceElements& surface) const;

    const Domain& domain_;
    std::vector<Goal> goal_;   ///< per patch
    std::vector<Goal> finest_; ///< per patch: how far the criterion of normals may go
    double normal_angle_deg_ = 180;
};

} // namespace hexopt
