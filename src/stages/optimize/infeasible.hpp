#pragma once

#include "core/csr.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <cstdint>
#include <span>

namespace hexopt {

/// What no placing of the movable vertices can mend.
struct Infeasibility {
    /// Cells that stay bad: a tetrahedron that depends on no movable vertex is not positive. Rising.
    std::vector<Index> cells;
    /// At least one cell of every row stays bad: tetrahedra that depend on one movable vertex only cannot all
    /// be positive. Rows are rising and share no cell with one another or with `cells`.
    Csr<Index> groups;

    /// No placing leaves fewer bad cells than this.
    std::size_t bound() const { return cells.size() + groups.rows(); }
};

/// Proves which of the `suspects` (cells, those found bad after optimization) must stay bad, or have a
/// neighbour that must. movable: per vertex, as for Problem; hanging vertices follow. tets: which
/// tetrahedra count, bits of hex::kTetEdge. Every answer is a proof in exact arithmetic from the coordinates
/// as stored (Farkas: non-negative multipliers, not all zero, of the half-spaces whose weighted sum has no
/// normal and no positive offset); what is not proved may still be infeasible. Coordinates must be finite.
Infeasibility prove_infeasible(const HexMesh& mesh, const Topology& topology,
                               std::span<const std::uint8_t> movable, std::span<const Index> suspects,
                               std::uint32_t tets);

} // namespace hexopt
