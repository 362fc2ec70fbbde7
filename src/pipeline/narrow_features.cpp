#include "pipeline/narrow_features.hpp"

#include "domain/drop_curves.hpp"
#include "domain/split_curves.hpp"
#include "pipeline/cell_boxes.hpp"

namespace hexopt {

NarrowCurves find_narrow_features(const Domain& domain, const HexMesh& octree, const MeshOptions& options) {
    if (!options.feature_lines.empty() || !(options.narrow_cells > 0) || domain.model.curve_count() < 2 ||
        octree.cells.empty())
        return {};
    NarrowOptions narrow;
    narrow.width = options.narrow_cells;
    narrow.below_deg = options.noise_angle_deg;
    const CellBoxes leaves(octree);
    return find_narrow_curves(
        domain, [&](const Point& p) { return leaves.smallest_size_at(p); }, narrow);
}

Result<std::optional<Domain>> leave_out(const Domain& domain, const NarrowCurves& narrow, Context& context) {
    if (narrow.narrow.empty()) return std::optional<Domain>();
    std::optional<Domain> cut;
    if (!narrow.cuts.empty()) {
        auto split = split_curves(domain, narrow.cuts, context);
        if (!split) return split.error();
        cut = std::move(*split);
    }
    auto left = drop_curves(cut ? *cut : domain, narrow.narrow, context);
    if (!left) return left.error();
    return std::optional<Domain>(std::move(*left));
}

} // namespace hexopt
