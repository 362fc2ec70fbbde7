#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/feature_graph.hpp"
#include "mesh/feature_lines.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Given lines as edges of a polygonal surface.
struct FollowedLines {
    struct Gap {
        const FeatureLines* lines;
        Point place; ///< of the line, from where on no edges follow it
        bool at_end; ///< a line's end, and no vertex is there
    };
    std::vector<std::array<Index, 2>> edges; ///< smaller vertex first; sorted
    std::vector<Gap> gaps; ///< one for each line (from junction to junction) that no chain of edges follows
};

/// For each line the chain of a surface's edges that follows it from end to end, or round a closed one: the
/// nearest of those whose vertices are within `reach` (per vertex, model units) of the line, and whose edges
/// cut across its bends by at most a fifth of their length more. Deterministic. Errors: cancelled.
Result<FollowedLines> follow_lines(std::span<const Point> positions, const SurfacePolygons& polygons,
                                   std::span<const FeatureLines> lines, std::span<const double> reach,
                                   const Context& context);

} // namespace hexopt
