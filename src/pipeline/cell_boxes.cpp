#include "pipeline/cell_boxes.hpp"

#include <algorithm>
#include <limits>

namespace hexopt {

CellBoxes::CellBoxes(const HexMesh& octree) : boxes_(octree.cell_count()) {
    Box frame;
    for (Index c = 0; c < octree.cell_count(); ++c) {
        for (Index v : octree.cells[c]) boxes_[c].add(octree.positions[v]);
        frame.add(boxes_[c]);
    }
    tree_ = BoxTree(frame);
    root_ = tree_.add_tree(boxes_, 0, order_);
}

double CellBoxes::smallest_size_at(const Point& p) const {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double size = kNone;
    visit_at(p, [&](Index cell) {
        const Point extent = boxes_[cell].high - boxes_[cell].low;
        size = std::min(size, std::max({extent.x, extent.y, extent.z}));
    });
    return size < kNone ? size : 0;
}

} // namespace hexopt
