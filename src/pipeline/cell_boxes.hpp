#pragma once

#include "domain/box_tree.hpp"
#include "mesh/hex_mesh.hpp"

#include <vector>

namespace hexopt {

/// The cells of an octree by place: their bounding boxes in a tree.
class CellBoxes {
  public:
    /// octree: at least one cell.
    explicit CellBoxes(const HexMesh& octree);

    const Box& box(Index cell) const { return boxes_[cell]; }

    /// Calls visit(cell) for every cell whose box holds p, its sides included.
    template <class Visit>
    void visit_at(const Point& p, const Visit& visit) const {
        tree_.visit_near(root_, p, 0.0, [&](Index first, Index last) {
            for (Index k = first; k < last; ++k)
                if (holds(boxes_[order_[k]], p)) visit(order_[k]);
        });
    }

    /// Longest edge of the smallest cell that holds p; 0: none does.
    double smallest_size_at(const Point& p) const;

  private:
    static bool holds(const Box& box, const Point& p) {
        for (int k = 0; k < 3; ++k)
            if (p[k] < box.low[k] || p[k] > box.high[k]) return false;
        return true;
    }

    std::vector<Box> boxes_;
    BoxTree tree_;
    Index root_ = 0;
    std::vector<Index> order_; ///< cell of each leaf item
};

} // namespace hexopt
