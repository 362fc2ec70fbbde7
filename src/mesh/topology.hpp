#pragma once

#include "core/csr.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt {

/// A corner of a cell: `corner` is the vertex's place in the cell, 0..7.
struct CellCorner {
    Index cell;
    std::uint32_t corner;
};

/// A face of a cell, numbered as hex::kFaceVertex.
struct CellFace {
    Index cell;
    std::uint32_t face;
};

/// Adjacency derived from a mesh; valid while the mesh keeps the same revision.
struct Topology {
    std::uint64_t revision = 0;
    Csr<CellCorner> vertex_cell; ///< cells that list the vertex itself, by rising cell number
    std::vector<CellFace>
        boundary_faces; ///< faces on the true boundary (not those between refinement levels)
    std::vector<std::uint8_t> on_boundary; ///< per vertex: 1 where a boundary face uses it
    std::vector<Index>
        hanging_row; ///< per vertex: row in mesh.hanging, kNoIndex if not hanging; empty if none hang
};

/// Vertices of a cell's face, seen from outside the cell counter-clockwise.
Quad face_vertices(const HexMesh& mesh, CellFace face);

/// Builds adjacency of a structurally valid mesh. Cost: O(cells), one sort of the faces.
Topology compute_topology(const HexMesh& mesh);

} // namespace hexopt
