#pragma once

#include "domain/segment_tree.hpp"
#include "mesh/outline.hpp"

#include <vector>

namespace hexopt {

/// A point of an outline that gets a mesh vertex of its own.
struct OutlineCorner {
    double s;         ///< arc length from the loop's first point, model units
    Point2 point;     ///< bit for bit as given
    double angle_deg; ///< through the region, 0..360
    bool is_sharp;    ///< turns by more than the feature angle; else only patches meet there
};

/// Outlines by arc length: what boundary vertices of a planar mesh slide on. The region lies on the left of
/// each loop. Immutable, thread-safe.
class OutlineCurves {
  public:
    /// A point is a corner where the outline turns by more than feature_angle_deg, or patches meet.
    OutlineCurves(const Outline& outline, double feature_angle_deg);

    std::size_t loop_count() const { return loops_.size(); }
    /// A place in the outline's plane, for messages.
    std::string describe(const Point2& p) const { return outline_->describe(p); }
    double length(Index loop) const { return loops_[loop].length; }
    const std::vector<OutlineCorner>& corners(Index loop) const { return loops_[loop].corners; }
    std::size_t corner_count() const;
    /// Curves between corners; a loop without any is one.
    std::size_t curve_count() const;
    double diagonal() const { return box_.diagonal(); }
    const Box2& box() const { return box_; }

    /// s may lie outside of 0..length: the loop goes on.
    Point2 point(Index loop, double s) const;
    Point2 tangent(Index loop, double s) const;
    Index patch(Index loop, double s) const;

    const SegmentTree& tree() const { return tree_; }
    Index loop_of(Index segment) const { return loop_of_[segment]; }
    double s_of(Index segment, double t) const;
    /// Length of the curve between two corners (the whole loop without two) that a segment belongs to.
    double curve_length(Index segment) const { return curve_length_[segment]; }
    /// Whether the region lies inside of the loop: it runs counter-clockwise.
    bool is_outer(Index loop) const { return loops_[loop].area > 0; }
    /// The smallest loop round p; kNoIndex where there is none.
    Index innermost_loop(const Point2& p) const;
    /// Whether p lies inside an odd number of loops.
    bool is_inside(const Point2& p) const;
    /// Largest distance of the outline between two places from the chord between them; from < to.
    double chord_deviation(Index loop, double from, double to) const;

  private:
    struct Loop {
        std::vector<double> s; ///< of each point, and the length at the end
        double length, area;
        Index first_segment;
        std::vector<OutlineCorner> corners; ///< by rising s
    };
    /// Segment that holds s, counted within the loop, and s brought into 0..length.
    Index locate(const Loop& loop, double& s) const;
    void measure_curves(const Loop& loop);
    /// Visits the segments that the ray from p along x crosses.
    template <class Visit>
    void visit_ray(const Point2& p, const Visit& visit) const;

    const Outline* outline_;
    std::vector<Loop> loops_;
    std::vector<Index> loop_of_;
    std::vector<double> curve_length_;
    SegmentTree tree_;
    Box2 box_;
};

} // namespace hexopt
