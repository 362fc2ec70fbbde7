#pragma once

#include "core/random.hpp"
#include "mesh/remap.hpp"

#include <array>

namespace hexopt::test {

/// Random numbering of vertices and cells.
inline Remap random_remap(const HexMesh& mesh, std::uint64_t seed) {
    Random random(seed);
    Remap remap = identity_remap(mesh);
    for (auto* order : {&remap.vertex_old2new, &remap.cell_old2new})
        for (std::size_t i = order->size(); i-- > 1;) std::swap((*order)[i], (*order)[random.below(i + 1)]);
    return remap;
}

/// Turns the numbering inside each cell by one of the 24 rotations of the cube.
inline void turn_cells(HexMesh& mesh, std::uint64_t seed) {
    constexpr std::array<std::uint8_t, 8> kAboutZ = {1, 2, 3, 0, 5, 6, 7, 4},
                                          kAboutX = {4, 5, 1, 0, 7, 6, 2, 3};
    Random random(seed);
    for (Cell& cell : mesh.cells)
        for (std::uint64_t turns = random.below(24); turns-- > 0;) {
            const Cell old = cell;
            const auto& turn = random.below(2) ? kAboutZ : kAboutX;
            for (int k = 0; k < 8; ++k) cell[k] = old[turn[k]];
        }
}

} // namespace hexopt::test
