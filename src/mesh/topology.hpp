#pragma once

#include "core/csr.hpp"
#include "core/parallel.hpp"
#include "mesh/hex_mesh.hpp"

#include <span>

namespace hexopt {

/// A corner of a cell: `corner` is the vertex's place in the cell, 0..7. Four bytes, as every mesh has eight
/// times as many as cells.
struct CellCorner {
    CellCorner() = default;
    CellCorner(Index of, std::uint32_t place) : cell(of & (kMostCells - 1)), corner(place & 7) {}

    /// Cells that can be told apart.
    static constexpr Index kMostCells = Index{1} << 29;
    Index cell : 29 = 0;
    std::uint32_t corner : 3 = 0;
    friend bool operator==(CellCorner, CellCorner) = default;
};
static_assert(sizeof(CellCorner) == 4);

/// A face of a cell, numbered as hex::kFaceVertex.
struct CellFace {
    Index cell;
    std::uint32_t face;
    friend auto operator<=>(CellFace, CellFace) = default;
};

/// Adjacency derived from a mesh; valid while the mesh keeps the same revision.
struct Topology {
    std::uint64_t revision = 0;
    Csr<CellCorner> vertex_cell; ///< cells that list the vertex itself, by rising cell number
    std::vector<CellFace>
        boundary_faces; ///< faces on the true boundary (not those between refinement levels)
    std::vector<std::uint8_t> on_boundary; ///< per vertex: 1 where a boundary face uses it, also if it hangs
    std::vector<Index>
        hanging_row; ///< per vertex: row in mesh.hanging, kNoIndex if not hanging; empty if none hang
    std::vector<CellFace> coarse_faces; ///< coarse sides of the faces between levels, by rising cell, face
    Csr<CellFace> fine_faces; ///< row i: the faces of smaller cells that together cover coarse_faces[i]
};

/// Vertices of a cell's face, seen from outside the cell counter-clockwise.
Quad face_vertices(const HexMesh& mesh, CellFace face);

/// Builds adjacency of a structurally valid mesh (validate_structure). A face used by one cell is on the true
/// boundary unless mesh.hanging shows that it covers, or is covered by, faces of another level; without
/// mesh.hanging every face used once counts as boundary: recognise_hanging() first where hanging vertices are
/// not known. Cost: O(cells), no temporary arrays but the result; same result for any thread count.
Topology compute_topology(const HexMesh& mesh, const Parallel& parallel);
inline Topology compute_topology(const HexMesh& mesh) { return compute_topology(mesh, Parallel(1)); }

/// Cells at every vertex, by rising cell number.
Csr<CellCorner> compute_vertex_cell(const HexMesh& mesh);

/// Faces that exactly one cell lists, by rising cell and face.
std::vector<CellFace> find_faces_used_once(const HexMesh& mesh, const Csr<CellCorner>& vertex_cell,
                                           const Parallel& parallel);

/// True boundary and faces between levels among the faces used once.
struct FaceClasses {
    std::vector<CellFace> boundary;
    std::vector<CellFace> coarse;
    Csr<CellFace> fine; ///< row i: what covers coarse[i]
};

/// Classifies faces used once by the hanging constraints alone (no positions): a face is coarse if the
/// vertices that the constraints put in the middle of its edges, and of the parts', cut it into faces of the
/// list. At most 8 cuts in a row (4 levels).
FaceClasses classify_faces(const HexMesh& mesh, std::span<const CellFace> used_once);

} // namespace hexopt
