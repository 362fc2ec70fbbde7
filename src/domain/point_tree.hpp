#pragma once

#include "domain/box_tree.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Some of a mesh's vertices (at least one), to be found by place.
class PointTree {
  public:
    PointTree(std::span<const Point> positions, std::span<const Index> vertices) : vertices_(vertices) {
        std::vector<Box> boxes(vertices.size());
        Box frame;
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            boxes[i].add(positions[vertices[i]]);
            frame.add(boxes[i]);
        }
        tree_ = BoxTree(frame);
        root_ = tree_.add_tree(boxes, 0, order_);
    }

    /// Calls visit(vertex) for all that may be within `radius` of p, and for some others.
    template <class Visit>
    void visit_within(const Point& p, double radius, const Visit& visit) const {
        tree_.visit_near(root_, p, radius * radius, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i) visit(vertices_[order_[i]]);
        });
    }

  private:
    std::span<const Index> vertices_;
    std::vector<Index> order_;
    BoxTree tree_;
    Index root_;
};

} // namespace hexopt
