#pragma once

#include "mesh/stencil.hpp"

namespace hexopt {

inline constexpr std::uint16_t kNoColour = 0xffff;

/// Vertices in classes that may move at the same time: no cell is in the balls of two of one colour, so no
/// tetrahedron depends on both, directly or through hanging vertices.
struct Colouring {
    std::uint64_t revision = 0;
    std::vector<std::uint16_t> colour; ///< per vertex; kNoColour: hanging, unused or not asked for
    Csr<Index> vertices;               ///< row: colour, largest class first; vertices by rising number
    std::size_t count() const { return vertices.rows(); }
};

/// Greedy colouring in order of the vertex numbers, then vertices of nearly empty colours are moved to
/// others, with one exchange where that is needed. `movable`: per vertex, 0 leaves it out; empty: all
/// vertices with a ball. Deterministic; O(entries of the stencils).
Colouring compute_colouring(const HexMesh& mesh, const Topology& topology, const Stencils& stencils,
                            std::span<const std::uint8_t> movable = {});

} // namespace hexopt
