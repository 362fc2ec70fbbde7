#pragma once

#include "core/parallel.hpp"
#include "domain/domain.hpp"
#include "domain/triangle_tree.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Which side of a surface points are on. The surface need not be closed: holes are closed by the smooth
/// surface on which the winding number is 1/2, and duplicates, overlaps and folds cost nothing but their own
/// place. Overlapping shells count as their union. Triangles must point outwards: orient_surface().
/// Immutable; queries are const and thread-safe, 1-5 us each.
class SurfaceQueries {
  public:
    /// The domain's model is kept by reference.
    explicit SurfaceQueries(const BoundaryModel& model);

    const BoundaryModel& model() const { return model_; }
    const TriangleTree& triangles() const { return tree_; }

    /// Winding number (TriangleTree::winding_number), to within about 0.01 of exact where it is near 1/2,
    /// and on the right side of 1/2 elsewhere.
    double winding_number(const Point& p) const;
    bool is_inside(const Point& p) const { return winding_number(p) > 0.5; }
    std::vector<std::uint8_t> are_inside(std::span<const Point> points, const Parallel& parallel) const;

    /// Distance to the surface, model units; positive inside. hint: as BoundaryModel::project_patch.
    double signed_depth(const Point& p, Index hint = kNoIndex) const;
    std::vector<double> signed_depths(std::span<const Point> points, const Parallel& parallel) const;

    /// True where the segment meets a triangle.
    bool crosses_surface(const Point& from, const Point& to) const;
    /// True where a segment between two points inside leaves the inside between: parts of the surface that
    /// have the inside on both sides (overlapping shells) do not count.
    bool leaves_inside(const Point& from, const Point& to) const;
    /// True where a step across the closest point of the surface changes sides, which it does not where the
    /// surface has the inside (or the outside) on both sides. `at`: a projection of p on the whole surface.
    bool is_side_changed(const Point& p, const Projection& at) const;

  private:
    const BoundaryModel& model_;
    TriangleTree tree_;
};

} // namespace hexopt
