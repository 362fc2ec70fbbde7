#pragma once

#include "core/parallel.hpp"
#include "mesh/topology.hpp"

#include <cstdint>
#include <vector>

namespace hexopt {

struct VisibleFace {
    CellFace face;
    bool is_cut; ///< not on the mesh's boundary: uncovered because cells were left out
    friend bool operator==(VisibleFace, VisibleFace) = default;
};

/// The faces around the cells with keep[cell] != 0, by rising cell and face. A coarse face is visible when
/// any cell on its fine side is left out. `keep` empty: all cells.
std::vector<VisibleFace> find_visible_faces(const HexMesh& mesh, const Topology& topology,
                                            const std::vector<std::uint8_t>& keep, const Parallel& parallel);

} // namespace hexopt
