#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

namespace hexopt {

/// What weld_surface() did.
struct WeldReport {
    std::size_t open_edges_before = 0, open_edges_after = 0;
    std::size_t merged_vertices = 0;   ///< on open edges, moved onto another one
    std::size_t cut_triangles = 0;     ///< at vertices that lay on their edges (T-junctions)
    std::size_t dropped_triangles = 0; ///< with two equal vertices, before or after, and flaps
};

struct WeldedSurface {
    TriangleSoup soup; ///< equal vertices merged; patches and names as given
    WeldReport report;
};

/// Drops flaps (triangles no higher than `tolerance` with two open edges, laid upon an edge of two others).
/// Closes cracks: joins open edges (used by one triangle) that are nearest to one another, both ends within
/// 10 times `tolerance` and 0.3 of the shorter one; merges vertices of open edges that are within `tolerance`
/// of one another, then cuts triangles whose open edges pass other open vertices within it. Closed parts stay
/// as they are. tolerance: model units, >= 0; to be well below the cell size. Deterministic. Errors: usage (a
/// negative tolerance), bad_input (an id out of range, a coordinate that is not finite), cancelled.
Result<WeldedSurface> weld_surface(const TriangleSoup& soup, double tolerance, Context& context);

} // namespace hexopt
