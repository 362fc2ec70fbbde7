#pragma once

#include "core/context.hpp"
#include "core/csr.hpp"
#include "core/union_find.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"
#include "stages/optimize/optimize.hpp"

#include <memory>
#include <span>

namespace hexopt {

/// Decompositions of a cell (thesis 4.2.2) as bits of hex::kTetEdge.
inline constexpr std::uint32_t kCornerTets = 0x11111111u, kPathTets = ~kCornerTets, kAllTets = ~0u;

constexpr std::uint32_t tets_of(Decomposition decomposition) {
    return decomposition == Decomposition::corner8  ? kCornerTets
           : decomposition == Decomposition::path24 ? kPathTets
                                                    : kAllTets;
}

/// A vertex's share in the position of another: x = ... + weight * x[dof].
struct DofShare {
    Index dof;
    float weight;
};

/// Which vertices move, which cells that concerns and in which order they are visited. The vertices that move
/// are the degrees of freedom (dofs), numbered along the mesh's adjacency for locality. Built for a whole
/// mesh or for a neighbourhood of it; positions are not part of it.
class Problem {
  public:
    /// mesh and topology must outlive the problem.
    /// movable[v] != 0: vertex v may move (hanging vertices never count as movable; they follow).
    /// tets: which tetrahedra count, bits of hex::kTetEdge. inverse_stretch: as HexGroup's, of all cells of
    /// the mesh, must outlive the problem; empty: cubes.
    Problem(const HexMesh& mesh, const Topology& topology, std::span<const std::uint8_t> movable,
            std::uint32_t tets = kAllTets, std::span<const float> inverse_stretch = {},
            const Parallel& parallel = Parallel(1));

    const HexMesh& mesh() const { return *mesh_; }
    std::size_t dof_count() const { return dof_vertex_.size(); }
    std::size_t cell_count() const { return cell_id_.size(); } ///< cells with a movable corner

    std::span<const Index> dof_vertex() const { return dof_vertex_; } ///< dof -> vertex
    const Cell& cell(std::size_t i) const { return mesh_->cells[cell_id_[i]]; }
    std::span<const Index> cell_id() const { return cell_id_; } ///< numbers of the cells in the mesh
    std::span<const float> inverse_length() const { return inverse_length_; } ///< one a cell
    /// HexGroup::inverse_stretch, null for cubes.
    const float* inverse_stretch() const {
        return inverse_stretch_.empty() ? nullptr : inverse_stretch_.data();
    }
    std::span<const float> weight() const { return weight_; }
    std::span<const std::uint32_t> tet_mask() const { return tet_mask_; }
    const Csr<Index>& cell_dof() const { return cell_dof_; } ///< dofs that a cell depends on, sorted

    /// Frees cell_dof(), which only the construction of solvers needs (40 bytes a cell).
    void release_cell_dof() { cell_dof_ = {}; }

    /// Dof of a vertex, kNoIndex where it is fixed or hanging.
    Index vertex_dof(Index vertex) const { return numbers_->vertex_dof[vertex]; }

    /// Dofs that a vertex depends on: itself, or the movable masters of a hanging vertex.
    std::span<const DofShare> shares(Index vertex) const {
        const Numbers& numbers = *numbers_;
        if (const Index dof = numbers.vertex_dof[vertex]; dof != kNoIndex) return {&self_share_[dof], 1};
        if (numbers.hanging_row.empty() || numbers.hanging_row[vertex] == kNoIndex) return {};
        return numbers.hanging_share[numbers.hanging_row[vertex]];
    }

    /// Row of mesh.hanging, kNoIndex where a vertex does not hang.
    Index hanging_row(Index vertex) const {
        return numbers_->hanging_row.empty() ? kNoIndex : numbers_->hanging_row[vertex];
    }
    bool has_hanging() const { return !hanging_rows_.empty(); }
    bool cell_has_hanging(std::size_t cell) const { return !cell_hanging_.empty() && cell_hanging_[cell]; }

    /// Rows of mesh.hanging that depend on dofs.
    std::span<const Index> hanging_rows() const { return hanging_rows_; }

    /// Recomputes the hanging vertices that depend on dofs.
    void apply_hanging(std::span<Point> positions) const { apply_hanging(positions, hanging_rows_); }
    void apply_hanging(std::span<Point> positions, std::span<const Index> rows) const;

    /// Measures target sizes from the current positions: the mean edge length of each cell along the three
    /// directions together, each edge over its direction's stretch (delta = its cube), not below 1e-3 of the
    /// mean over the mesh.
    void update_lengths(std::span<const Point> positions, const Parallel& parallel);

    /// The sets of dofs that cells connect, directly or through others, as problems of their own, by their
    /// lowest dof; what one does to the positions, no other sees. Before release_cell_dof(). Ask a part only
    /// for the vertices of its own cells.
    static std::vector<Problem> split(Problem whole);

  private:
    /// By numbers of the mesh; what parts of a problem share, as no vertex depends on dofs of two.
    struct Numbers {
        std::vector<Index> vertex_dof;
        Csr<DofShare> hanging_share;        ///< per hanging row
        std::span<const Index> hanging_row; ///< of the topology: per vertex, empty in conforming meshes
    };

    Problem() = default;
    void number_dofs(const Topology& topology, std::span<const std::uint8_t> movable, Numbers& numbers);
    void make_shares(const Topology& topology, Numbers& numbers);
    void collect_cells(const Topology& topology);
    void order_cells(std::uint32_t tets, const Parallel& parallel);
    void collect_dofs(std::size_t i, std::vector<Index>& dofs);
    std::uint32_t moving_tets(std::size_t i) const;
    void set_weights();
    void add_dof(Index vertex);

    const HexMesh* mesh_ = nullptr;
    std::shared_ptr<const Numbers> numbers_;
    std::vector<Index> dof_vertex_;
    std::vector<DofShare> self_share_; ///< per dof
    std::vector<Index> hanging_rows_;
    std::vector<Index> cell_id_;
    std::vector<std::uint8_t> cell_hanging_;
    Csr<Index> cell_dof_;
    std::span<const float> inverse_stretch_;
    std::vector<float> inverse_length_, weight_;
    std::vector<std::uint32_t> tet_mask_;
};

/// Sets of dofs that cells connect, directly or through others.
UnionFind find_dof_parts(const Problem& problem);

} // namespace hexopt
