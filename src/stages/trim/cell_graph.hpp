#pragma once

#include "mesh/topology.hpp"

namespace hexopt::trimming {

/// Which cells of an octree leaf mesh touch, also across levels.
struct CellGraph {
    /// Per cell and face (hex::kFaceVertex): the cell behind it, kNoIndex on the mesh's own boundary, or
    /// kFine | row where smaller cells are behind it.
    std::vector<std::array<Index, 6>> neighbour;
    static constexpr Index kFine = Index{1} << 31;

    std::vector<CellFace> coarse_faces; ///< per row: the large side
    Csr<CellFace> fine_faces;           ///< per row: the small ones
    Csr<CellCorner> vertex_cell;        ///< cells that list the vertex
    Csr<Index> vertex_coarse;           ///< cells on one of whose edges or faces the vertex hangs
    Csr<Index> cell_hanging;            ///< the same by cell: vertices

    /// A vertex inside an edge of some cell, a < b; sorted. One edge may hold several, in order from a to b;
    /// where smaller cells on one side see fewer than on another, the longest list comes last.
    struct EdgeMiddle {
        Index a, b;
        std::uint16_t count, place; ///< place-th (from 1) of `count` on this edge
        Index vertex;
        auto operator<=>(const EdgeMiddle&) const = default;
    };
    std::vector<EdgeMiddle> edge_middles;
    /// Calls visit(longest list) for every edge with vertices inside.
    template <class Visit>
    void for_each_split_edge(const Visit& visit) const {
        const std::span<const EdgeMiddle> all = edge_middles;
        for (std::size_t i = 0; i < all.size();) {
            std::size_t end = i + 1;
            while (end < all.size() && all[end].a == all[i].a && all[end].b == all[i].b) ++end;
            visit(all.subspan(end - all[end - 1].count, all[end - 1].count));
            i = end;
        }
    }
    /// A vertex inside a face of a cell, sorted by vertex.
    struct FaceMiddle {
        Index vertex, row;
        auto operator<=>(const FaceMiddle&) const = default;
    };
    std::vector<FaceMiddle> face_middles;

    /// Calls visit(cell) for every cell behind a face.
    template <class Visit>
    void visit_behind(Index cell, int face, const Visit& visit) const {
        const Index behind = neighbour[cell][static_cast<std::size_t>(face)];
        if (behind == kNoIndex) return;
        if (!(behind & kFine)) return visit(behind);
        for (CellFace fine : fine_faces[behind & ~kFine]) visit(fine.cell);
    }
    bool is_outer(Index cell, int face) const {
        return neighbour[cell][static_cast<std::size_t>(face)] == kNoIndex;
    }
    /// Cells that touch a vertex: those that list it, then those on which it hangs.
    void gather_star(Index vertex, std::vector<Index>& star) const;
};

/// The mesh must be structurally valid (validate_structure), with fewer than 2^31 cells.
CellGraph build_cell_graph(const HexMesh& mesh, const Parallel& parallel);

/// True where the vertices are ends of one edge of the cell.
bool has_edge(const Cell& cell, Index a, Index b);

} // namespace hexopt::trimming
