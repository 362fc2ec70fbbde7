#pragma once

#include "core/context.hpp"
#include "domain/domain.hpp"
#include "stages/fit/curve_net.hpp"
#include "stages/fit/surface_mesh.hpp"
#include "stages/fit/vertex_tree.hpp"

#include <vector>

namespace hexopt::fit {

/// A part of a leg that mesh edges follow although no path runs along the whole.
struct Piece {
    Index leg;
    std::vector<Index> path; ///< in the leg's direction
};

/// Mesh vertices for anchors and paths of mesh edges for legs. Vertices are local ones.
struct Capture {
    std::vector<Index> anchor_vertex; ///< per anchor; kNoIndex: not captured
    std::vector<std::vector<Index>>
        path;                  ///< per leg: from its first anchor's vertex to the last's; empty: none
    std::vector<Piece> pieces; ///< of legs without a path
    int reroutes = 0;          ///< paths dropped to let another one through
};

struct CaptureOptions {
    double reach = 2;       ///< of a vertex from its anchor, in local edge lengths
    double path_reach = 3;  ///< of a path's vertices from the curve, in local edge lengths
    int reroutes_a_leg = 3; ///< limit of dropped paths, times the number of legs; at least 60
};

/// Captures corners, then curves (thesis section 3.5, fig. 3.8): nearest vertices with enough edges, then
/// shortest paths of edges near the curves, which drop and reroute one another where they are in each other's
/// way. Legs that one edge is to follow have its ends as their anchors' vertices. `unfitted`: the surface's
/// vertices before fairing, `placed`: after it; `tree`: of these.
Capture capture_features(const SurfaceMesh& surface, const std::vector<Point>& unfitted,
                         const std::vector<Point>& placed, const VertexTree& tree, const Domain& domain,
                         const CurveNet& net, const CaptureOptions& options, const Context& context);

/// Follows legs without a path as far as free edges close to the curve go: from their ends, or else from the
/// middle. Fills capture.pieces.
void capture_pieces(const SurfaceMesh& surface, const std::vector<Point>& placed, const VertexTree& tree,
                    const Domain& domain, const CurveNet& net, Capture& capture, const Context& context);

} // namespace hexopt::fit
