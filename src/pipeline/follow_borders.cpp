#include "pipeline/follow_borders.hpp"

#include "domain/smooth_borders.hpp"
#include "pipeline/cell_boxes.hpp"
#include "stages/refine/refine.hpp"

namespace hexopt {

namespace {

Result<SmoothBorders> find_borders_with_room(const PreparedDomain& prepared, const MeshOptions& options,
                                             Context& context) {
    const auto refined = refine(prepared.domain, options.refine, context);
    if (!refined) return refined.error();
    if (refined->octree.cells.empty()) return SmoothBorders();
    const CellBoxes leaves(refined->octree);
    return find_smooth_borders(prepared.bordered->soup, options.features, prepared.bordered->edges,
                               [&](const Point& p) { return leaves.smallest_size_at(p); });
}

} // namespace

Result<std::size_t> follow_borders(PreparedDomain& prepared, const MeshOptions& options, StageClock& clock,
                                   Context& context) {
    if (!prepared.bordered) return 0;
    const auto borders =
        clock.run("smooth_borders", [&] { return find_borders_with_room(prepared, options, context); });
    if (!borders) return borders.error();
    if (!borders->edges.empty()) {
        FeaturedSurface& surface = *prepared.bordered;
        surface.edges.insert(surface.edges.end(), borders->edges.begin(), borders->edges.end());
        auto domain = clock.run(
            "domain", [&] { return build_domain(surface.soup, options.features, context, surface.edges); });
        if (!domain) return domain.error();
        prepared.domain = std::move(*domain);
    }
    prepared.bordered.reset();
    return borders->count;
}

} // namespace hexopt
