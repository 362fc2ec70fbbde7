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
    /// Mesh edges that follow a curve: vertices (smaller first) and curve, sorted.
    struct RidgeEdge {
        Index a, b, curve;
        auto operator<=>(const RidgeEdge&) const = default;
    };
    std::vector<RidgeEdge> ridges;
};

} // namespace hexopt
