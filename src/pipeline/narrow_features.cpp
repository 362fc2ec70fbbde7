#include "pipeline/narrow_features.hpp"

#include "domain/box_tree.hpp"

#include <algorithm>
#include <glm/common.hpp>
#include <limits>

namespace hexopt {

namespace {

class LeafSizes {
  public:
    explicit LeafSizes(const HexMesh& octree) : boxes_(octree.cell_count()) {
        Box frame;
        for (Index c = 0; c < octree.cell_count(); ++c) {
            for (Index v : octree.cells[c]) boxes_[c].add(octree.positions[v]);
            frame.add(boxes_[c]);
        }
        tree_ = BoxTree(frame);
        root_ = tree_.add_tree(boxes_, 0, order_);
    }

    /// Longest edge of the smallest leaf that holds p; 0: none does.
    double at(const Point& p) const {
        double size = std::numeric_limits<double>::infinity();
        tree_.visit_near(root_, p, 0.0, [&](Index first, Index last) {
            for (Index k = first; k < last; ++k) {
                const Box& box = boxes_[order_[k]];
                const Point out = glm::max(box.low - p, p - box.high), extent = box.high - box.low;
                if (std::max({out.x, out.y, out.z}) <= 0)
                    size = std::min(size, std::max({extent.x, extent.y, extent.z}));
            }
        });
        return size < std::numeric_limits<double>::infinity() ? size : 0;
    }

  private:
    std::vector<Box> boxes_;
    BoxTree tree_;
    Index root_ = 0;
    std::vector<Index> order_;
};

} // namespace

NarrowCurves find_narrow_features(const Domain& domain, const HexMesh& octree, const NarrowOptions& options) {
    if (!(options.width > 0) || domain.model.curve_count() < 2 || octree.cells.empty()) return {};
    const LeafSizes sizes(octree);
    return find_narrow_curves(
        domain, [&](const Point& p) { return sizes.at(p); }, options);
}

} // namespace hexopt
