#include "pipeline/narrow_features.hpp"

#include "pipeline/cell_boxes.hpp"

#include <algorithm>
#include <limits>

namespace hexopt {

namespace {

/// Longest edge of the smallest leaf that holds p; 0: none does.
double smallest_leaf_at(const CellBoxes& leaves, const Point& p) {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double size = kNone;
    leaves.visit_at(p, [&](Index leaf) {
        const Point extent = leaves.box(leaf).high - leaves.box(leaf).low;
        size = std::min(size, std::max({extent.x, extent.y, extent.z}));
    });
    return size < kNone ? size : 0;
}

} // namespace

NarrowCurves find_narrow_features(const Domain& domain, const HexMesh& octree, const NarrowOptions& options) {
    if (!(options.width > 0) || domain.model.curve_count() < 2 || octree.cells.empty()) return {};
    const CellBoxes leaves(octree);
    return find_narrow_curves(
        domain, [&](const Point& p) { return smallest_leaf_at(leaves, p); }, options);
}

} // namespace hexopt
