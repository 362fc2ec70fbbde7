#pragma once

#include "mesh/topology.hpp"

#include <array>

namespace hexopt {

/// How far each corner of a cell moves when a vertex moves by 1: 1 at the vertex itself, the constraint's
/// weight at vertices that hang on it, else 0.
using CornerWeights = std::array<double, 8>;

/// Ball of every free vertex: all cells that change when it moves, also those that it touches only through
/// vertices hanging on it (method.md, thesis 4.2.1). An entry is {cell, pattern}: the cell's corners move by
/// patterns[pattern] times the vertex's displacement. Patterns 0..7 are the single corners, so that an entry
/// of a conforming mesh reads {cell, corner} and its stencils are the topology's own vertex_cell, not a copy.
struct Stencils {
    std::uint64_t revision = 0;
    std::vector<CornerWeights> patterns;
    Csr<CellCorner> own;                         ///< balls where vertices hang; empty for a conforming mesh
    const Csr<CellCorner>* conforming = nullptr; ///< else the topology's, which must outlive this

    /// Entries by rising cell number; none for hanging and unused vertices.
    std::span<const CellCorner> ball(std::size_t vertex) const {
        return conforming ? (*conforming)[vertex] : own[vertex];
    }
    const CornerWeights& weights(CellCorner entry) const { return patterns[entry.corner]; }
    std::size_t vertex_count() const { return conforming ? conforming->rows() : own.rows(); }
};

/// Builds the stencils of a structurally valid mesh with closed constraints. O(cells).
Stencils compute_stencils(const HexMesh& mesh, const Topology& topology);

} // namespace hexopt
