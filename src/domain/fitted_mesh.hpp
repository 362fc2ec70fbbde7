#pragma once

#include "domain/boundary_model.hpp"
#include "mesh/hex_mesh.hpp"

#include <vector>

namespace hexopt {

/// A mesh whose boundary follows a Domain: what the stages from fitting to buffer layers pass on.
struct FittedMesh {
    /// mesh.boundary lists every quad of the true boundary with its patch of the Domain (not the named one);
    /// kNoIndex where it has none. mesh.hanging holds the hanging vertices, also those of the boundary.
    HexMesh mesh;
    std::vector<Association> association; ///< per vertex
    /// Per vertex, where it would be had the boundary not been fitted; empty: not known. The cells there are
    /// near the staircase of boxes that trimming left: sound but for layers that it has no room for.
    std::vector<Point> unfitted;
    /// Mesh edges that follow a curve: vertices (smaller first) and curve, sorted.
    struct RidgeEdge {
        Index a, b, curve;
        auto operator<=>(const RidgeEdge&) const = default;
    };
    std::vector<RidgeEdge> ridges;
};

} // namespace hexopt
