#pragma once

#include "domain/box_tree.hpp"
#include "domain/closest_point.hpp"

#include <array>
#include <glm/geometric.hpp>
#include <span>
#include <vector>

namespace hexopt {

struct CurveSegment {
    Index curve;
    double s; ///< arc length where it begins
    std::array<Point, 2> end;
};

/// The segments of curves by place.
class CurveSegments {
  public:
    /// Curves are numbered in the order in which they are added.
    void add_curve(std::span<const Point> points) {
        const auto curve = static_cast<Index>(length_.size());
        double s = 0;
        for (std::size_t i = 0; i + 1 < points.size(); ++i) {
            segments_.push_back({curve, s, {points[i], points[i + 1]}});
            s += glm::distance(points[i], points[i + 1]);
        }
        length_.push_back(s);
    }
    /// Once all curves are there.
    void build_tree() {
        if (segments_.empty()) return;
        Box frame;
        std::vector<Box> boxes(segments_.size());
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            for (const Point& p : segments_[i].end) boxes[i].add(p);
            frame.add(boxes[i]);
        }
        tree_ = BoxTree(frame);
        root_ = tree_.add_tree(boxes, 0, leaf_);
    }

    double length(Index curve) const { return length_[curve]; }

    /// Whether is_it(segment, closest point of it to p) holds for a segment near p: all are asked that come
    /// within `reach` (model units), and others.
    template <class IsIt>
    bool has_near(const Point& p, double reach, const IsIt& is_it) const {
        double best2 = reach * reach;
        bool found = false;
        tree_.visit_near(root_, p, best2, [&](Index first, Index last) {
            for (Index k = first; k < last && !found; ++k) {
                const CurveSegment& segment = segments_[leaf_[k]];
                found = is_it(segment, closest_on_segment(p, segment.end[0], segment.end[1]));
            }
            if (found) best2 = 0;
        });
        return found;
    }

  private:
    std::vector<CurveSegment> segments_;
    std::vector<double> length_; ///< per curve
    BoxTree tree_;
    Index root_ = 0;
    std::vector<Index> leaf_; ///< segment of each leaf item
};

} // namespace hexopt
