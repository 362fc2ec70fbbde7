#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/topology.hpp"

namespace hexopt {

struct FollowOptions {
    double distance_rel = 2e-4; ///< quads nearer to the surface are left alone; fraction of its diagonal, > 0
    double edge_rel = 1e-4;     ///< the same for edges on curves, nearer to their curve
    double min_sj = 0.25;       ///< cells may become worse than they are down to this, -1..1
    int rounds = 3;             ///< over all vertices, at least 1
    /// Vertices of quads and edges that stay farther are moved step by step in all directions, so that the
    /// largest distances shrink; fraction of the diagonal, 0: not.
    double search_rel = 2e-4;
    int search_rounds = 6;
    double search_share = 0.02; ///< vertices that may be tried, the farthest first, as a share of the cells
};

struct FollowReport {
    std::size_t moved = 0;      ///< boundary vertices
    std::size_t far_before = 0; ///< quads farther from the surface than FollowOptions::distance_rel
    std::size_t far_after = 0;
    double largest_before_rel =
        0; ///< of a quad's corners, edge midpoints and centre, fraction of the diagonal
    double largest_after_rel = 0;
};

/// Moves boundary vertices within what they are bound to onto the creases inside patches and the bends of
/// curves beside them, where their quads and edges then lie nearer to the surface: coarse tessellations have
/// edges that quads would cut across. Cells stay usable and do not become worse than they were and than
/// min_sj; what can be had with cells that stay better than that is done first. `model` holds the bindings of
/// the mesh. Hanging vertices follow those that they hang on; vertices off what they are bound to stay.
/// Errors: cancelled (the mesh is sound).
Result<FollowReport> follow_creases(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                    const FollowOptions& options, Context& context);

} // namespace hexopt
