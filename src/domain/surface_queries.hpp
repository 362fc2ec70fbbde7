#pragma once

#include "core/parallel.hpp"
#include "domain/domain.hpp"
#include "domain/triangle_tree.hpp"

#include <limits>
#include <span>
#include <vector>

namespace hexopt {

/// Winding numbers that count as inside: low < w <= high.
struct WindingRange {
    double low = 0.5, high = std::numeric_limits<double>::infinity();
    bool contains(double winding) const { return winding > low && winding <= high; }
};

/// Which side of a surface points are on. The surface need not be closed: holes are closed by the smooth
/// surface on which the winding number is 1/2, and duplicates, overlaps and folds cost nothing but their own
/// place. Overlapping shells count as their union. Triangles must point outwards: orient_surface().
/// Immutable; queries are const and thread-safe. A side costs 1-2 us where the surface is closed (every edge
/// has as many triangles in one direction as in the other): rays count it; else 3-50 us.
class SurfaceQueries {
  public:
    /// The domain's model is kept by reference.
    explicit SurfaceQueries(const BoundaryModel& model);
    /// Takes another side of the surface for the inside.
    void choose_inside(WindingRange inside) { inside_ = inside; }

    const BoundaryModel& model() const { return model_; }
    const TriangleTree& triangles() const { return tree_; }

    /// Whether every edge has as many triangles in one direction as in the other.
    bool is_closed() const { return closed_; }

    /// Winding number: whole where the surface is closed. Else as TriangleTree::winding_number, to within
    /// about 0.01 near the ends of the range of the inside, and on the right side of them elsewhere.
    double winding_number(const Point& p) const;
    bool is_inside(const Point& p) const { return inside_.contains(winding_number(p)); }
    std::vector<std::uint8_t> are_inside(std::span<const Point> points, const Parallel& parallel) const;

    /// Distance to the surface, model units; positive inside. hint: as BoundaryModel::project_patch.
    double signed_depth(const Point& p, Index hint = kNoIndex) const;
    std::vector<double> signed_depths(std::span<const Point> points, const Parallel& parallel) const;

    /// True where the segment meets a triangle.
    bool crosses_surface(const Point& from, const Point& to) const;
    /// True where a segment between two points inside leaves the inside for longer than `contact` (model
    /// units, > 0). Parts of the surface that have the inside on both sides do not count: overlapping shells,
    /// and solids that touch up to that distance.
    bool leaves_inside(const Point& from, const Point& to, double contact) const;
    /// True where the inside goes on behind the surface: `contact` beyond the closest point to p, seen from
    /// there, is inside. at: a projection of p on the whole surface.
    bool is_inside_beyond(const Point& p, const Projection& at, double contact) const;

  private:
    const BoundaryModel& model_;
    TriangleTree tree_;
    WindingRange inside_ = {};
    bool closed_;
};

} // namespace hexopt
