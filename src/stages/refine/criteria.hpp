#pragma once

#include "domain/surface_creases.hpp"
#include "stages/refine/closeness.hpp"
#include "stages/refine/gap_probe.hpp"
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
Goal goal_of(const TargetSize& target);

/// Patches that the input calls so.
std::vector<Index> patches_of_name(const Domain& domain, const std::string& name);

/// Longest edge of a cell of the hierarchy along the axes of `mask`, model units.
double node_size(const CellRefinement& refinement, Index node, AxisMask mask);

/// A cell and the surface in it.
struct CutCell {
    Box box;
    double size; ///< longest edge along the axes that are refined
    int depth;
    std::span<const Index> elements;
};

/// The criteria that look at a cell and the surface in it. Thread-safe; refers to domain and surface.
class SurfaceCriteria {
  public:
    /// Everything but the surface's size, which set_size() gives.
    SurfaceCriteria(const Domain& domain, const SurfaceElements& surface, const RefineOptions& options);

    /// Starts anew with another size of the surface's cells. Error (usage): a patch that the domain does not
    /// have.
    Status set_size(const RefineOptions& options, const TargetSize& size);

    /// The first criterion by which a cell is to be split, RefineCriterion::count if none.
    RefineCriterion ask(const CutCell& cell) const;
    /// Leaves a criterion out from now on.
    void give_up(RefineCriterion criterion) { given_up_[static_cast<std::size_t>(criterion)] = true; }
    /// Cells whose chord leaves the surface by more than so many times what is allowed get a level more than
    /// others; 0: none do.
    void set_steep(double times) { steep_ = times; }
    bool is_given_up(RefineCriterion criterion) const {
        return given_up_[static_cast<std::size_t>(criterion)];
    }

    /// Per patch: size of the smallest cells that gaps and features may get. base: longest edge of the
    /// initial mesh.
    std::vector<double> finest_sizes(double base) const;

    /// Largest angle between the interpolated normals of one patch inside a box, degrees.
    double normal_spread_deg(const Box& box, std::span<const Index> triangles) const;

  private:
    void coarsen_outer_box(const RefineOptions& options);
    bool allows(const std::vector<Goal>& finest, const CutCell& cell, Index element) const;
    double finest_gap_size(const CutCell& cell, Index element) const;
    bool wants(RefineCriterion criterion, const CutCell& cell) const;
    bool wants_surface_size(const CutCell& cell) const;
    bool wants_curve_size(const CutCell& cell) const;
    bool wants_normals(const CutCell& cell) const;
    void find_creases_in_patches();
    bool crosses_crease(const CutCell& cell, const std::vector<Goal>& finest, double chord_error) const;
    bool turns_too_far(const CutCell& cell, const std::vector<Goal>& finest, double limit_deg,
                       double chord_error) const;
    bool wants_gap(const CutCell& cell) const;
    bool wants_feature(const CutCell& cell) const;
    double curve_room(const CutCell& cell, Index segment, double reach) const;

    const Domain* domain_;
    const SurfaceElements* surface_;
    GapProbe probe_;
    Closeness closeness_;
    /// Part of the surface with goals of its own: a patch, or what of it lies in the sides of an outer box,
    /// which come after the patches.
    Index zone_of_triangle(Index triangle) const;
    Index zone_of_curve(Index patch) const;

    std::vector<Goal> goal_; ///< per zone
    /// Per zone: how far criteria of shape may go.
    std::vector<Goal> finest_bend_, finest_steep_, finest_gap_;
    std::vector<std::uint8_t> in_outer_box_;    ///< per triangle; empty without such a box
    std::vector<std::uint8_t> all_outer_;       ///< per patch: all of it is
    std::vector<std::vector<Goal>> curve_goal_; ///< per curve
    PatchCreases creases_; ///< where chords of the largest cells may leave the surface too far
    double normal_angle_deg_, chord_error_, gap_cells_, wall_cells_, feature_cells_;
    double steep_ = 0;
    std::array<bool, kCriterionCount> given_up_ = {};
};

} // namespace hexopt
