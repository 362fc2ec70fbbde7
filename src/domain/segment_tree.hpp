#pragma once

#include "mesh/outline.hpp"

#include <array>
#include <limits>
#include <vector>

namespace hexopt {

/// Axis-parallel rectangle.
struct Box2 {
    Point2 low = Point2(std::numeric_limits<double>::infinity());
    Point2 high = Point2(-std::numeric_limits<double>::infinity());

    void add(const Point2& p);
    void add(const Box2& box);
    bool meets(const Box2& other) const;
    double distance2(const Point2& p) const; ///< squared; 0 inside
    double diagonal() const;
};

/// Segments in the plane, for closest-point and range queries. Immutable; queries are thread-safe.
class SegmentTree {
  public:
    using Segment = std::array<Point2, 2>;
    struct Nearest {
        Index segment = kNoIndex; ///< the lowest number of equally near ones
        double t = 0;             ///< along it, 0..1
        Point2 point = {};
        double distance = std::numeric_limits<double>::infinity();
    };

    SegmentTree() = default;
    explicit SegmentTree(std::vector<Segment> segments);

    std::size_t size() const { return segments_.size(); }
    const Segment& segment(Index s) const { return segments_[s]; }

    /// Closest point within `reach` of p; segment kNoIndex where there is none.
    Nearest nearest(const Point2& p, double reach = std::numeric_limits<double>::infinity()) const;

    /// Calls visit(segment) for every segment whose box meets `box`, until it returns false.
    template <class Visit>
    void visit_box(const Box2& box, const Visit& visit) const {
        if (nodes_.empty()) return;
        std::vector<Index> stack = {0};
        while (!stack.empty()) {
            const Node& node = nodes_[stack.back()];
            stack.pop_back();
            if (!node.box.meets(box)) continue;
            if (node.count == 0) {
                stack.push_back(node.first + 1);
                stack.push_back(node.first);
                continue;
            }
            for (Index i = node.first; i < node.first + node.count; ++i) {
                const Index s = order_[i];
                Box2 own;
                for (const Point2& p : segments_[s]) own.add(p);
                if (own.meets(box) && !visit(s)) return;
            }
        }
    }

    /// Whether any segment meets the box (exactly, not only by its own box).
    bool meets(const Box2& box) const;

  private:
    struct Node {
        Box2 box;
        Index first; ///< of two children, or of `count` items
        Index count; ///< 0: inner node
    };
    void build(Index node, Index first, Index last);

    std::vector<Segment> segments_;
    std::vector<Index> order_;
    std::vector<Node> nodes_;
};

} // namespace hexopt
