#include "pipeline/cell_boxes.hpp"

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

} // namespace hexopt
