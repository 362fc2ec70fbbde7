#pragma once

#include "core/csr.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <array>
#include <vector>

namespace hexopt::fit {

/// The boundary of a volume mesh as a mesh of quads with local vertex numbers. On a border between levels a
/// coarse edge lies beside its two halves: each of the three has one quad, and `across` links them.
struct SurfaceMesh {
    struct Edge {
        Index a, b;                ///< local vertices, a < b
        std::array<Index, 2> quad; ///< beside it; kNoIndex: none
        bool ridge_allowed;        ///< two quads, and neither end hangs
    };
    std::vector<Index> vertex; ///< local to mesh vertex, rising
    std::vector<Index> local;  ///< mesh to local vertex, kNoIndex inside
    std::vector<Quad> quad;    ///< local vertices, counter-clockwise from outside; order of boundary_faces
    std::vector<Edge> edge;    ///< sorted by vertices
    std::vector<std::array<Index, 4>> quad_edge; ///< edge from corner k to k + 1
    Csr<Index> vertex_edge;
    Csr<Index> vertex_quad;
    std::vector<std::array<Index, 2>> across; ///< pairs of quads that meet along a border between levels
    std::vector<std::uint8_t> hanging;        ///< per local vertex
    std::vector<double> size;                 ///< per local vertex: mean length of its edges, model units
    Index other_end(Index e, Index v) const { return edge[e].a == v ? edge[e].b : edge[e].a; }
};

SurfaceMesh extract_surface(const HexMesh& mesh, const Topology& topology);

/// Edge between two local vertices, kNoIndex if there is none.
Index find_edge(const SurfaceMesh& surface, Index a, Index b);

} // namespace hexopt::fit
