#pragma once

#include "mesh/hex_reference.hpp"
#include "quality/cell_quality.hpp"

#include <random>

namespace hexopt::test {

inline HexPoints unit_cube() {
    HexPoints p;
    for (int k = 0; k < 8; ++k) p[k] = Point(hex::kVertexX[k], hex::kVertexY[k], hex::kVertexZ[k]);
    return p;
}

/// The cube [0, size]^3 with every coordinate moved by a whole number in -shift..shift.
inline HexPoints random_integer_hex(std::mt19937_64& random, int size, int shift) {
    std::uniform_int_distribution<int> move(-shift, shift);
    HexPoints p = unit_cube();
    for (Point& q : p)
        for (int i = 0; i < 3; ++i) q[i] = q[i] * size + move(random);
    return p;
}

/// The unit cube with every coordinate moved by up to `shift`.
inline HexPoints random_hex(std::mt19937_64& random, double shift) {
    std::uniform_real_distribution<double> move(-shift, shift);
    HexPoints p = unit_cube();
    for (Point& q : p)
        for (int i = 0; i < 3; ++i) q[i] += move(random);
    return p;
}

/// The 24 rotations of the cube as renumberings of its corners.
inline std::vector<std::array<int, 8>> cube_rotations() {
    std::vector<std::array<int, 8>> rotations;
    const int axes[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    for (int a = 0; a < 6; ++a)
        for (int flips = 0; flips < 8; ++flips) {
            const bool odd_axes = a >= 3;
            const bool odd_flips = (flips & 1) ^ (flips >> 1 & 1) ^ (flips >> 2);
            if (odd_axes != odd_flips) continue; // a reflection
            std::array<int, 8> rotation;
            for (int k = 0; k < 8; ++k) {
                const int c[3] = {hex::kVertexX[k], hex::kVertexY[k], hex::kVertexZ[k]};
                int r[3];
                for (int i = 0; i < 3; ++i) r[i] = c[axes[a][i]] ^ (flips >> i & 1);
                rotation[k] = hex::vertex_at(r[0], r[1], r[2]);
            }
            rotations.push_back(rotation);
        }
    return rotations;
}

inline HexPoints renumbered(const HexPoints& p, const std::array<int, 8>& rotation) {
    HexPoints q;
    for (int k = 0; k < 8; ++k) q[k] = p[rotation[k]];
    return q;
}

/// nx * ny * nz unit cubes, vertices x fastest.
inline HexMesh unit_grid(Index nx, Index ny, Index nz) {
    HexMesh mesh;
    for (Index z = 0; z <= nz; ++z)
        for (Index y = 0; y <= ny; ++y)
            for (Index x = 0; x <= nx; ++x) mesh.positions.emplace_back(x, y, z);
    for (Index z = 0; z < nz; ++z)
        for (Index y = 0; y < ny; ++y)
            for (Index x = 0; x < nx; ++x) {
                Cell cell;
                for (int k = 0; k < 8; ++k)
                    cell[k] = ((z + hex::kVertexZ[k]) * (ny + 1) + y + hex::kVertexY[k]) * (nx + 1) + x +
                              hex::kVertexX[k];
                mesh.cells.push_back(cell);
            }
    return mesh;
}

} // namespace hexopt::test
