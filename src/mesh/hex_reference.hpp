#pragma once

#include <array>
#include <cstdint>

/// The reference hexahedron. Vertices in VTK order; vertex v sits at (kVertexX[v], kVertexY[v], kVertexZ[v]).
///
///          7--------6        zeta
///         /|       /|         |  eta
///        4--------5 |         | /
///        | 3------|-2         |/___ xi
///        |/       |/
///        0--------1
namespace hexopt::hex {

inline constexpr std::array<std::uint8_t, 8> kVertexX = {0, 1, 1, 0, 0, 1, 1, 0};
inline constexpr std::array<std::uint8_t, 8> kVertexY = {0, 0, 1, 1, 0, 0, 1, 1};
inline constexpr std::array<std::uint8_t, 8> kVertexZ = {0, 0, 0, 0, 1, 1, 1, 1};

/// Vertex at (x, y, z), each 0 or 1.
constexpr int vertex_at(int x, int y, int z) { return z * 4 + (y ? (x ? 2 : 3) : x); }

/// Faces with outward normals: -x, +x, -y, +y, -z, +z.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kFaceVertex = {
    {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}};

/// Edges from low to high coordinate: 0-3 along xi (index y + 2z), 4-7 along eta (4 + x + 2z), 8-11 along
/// zeta (8 + x + 2y).
inline constexpr std::array<std::array<std::uint8_t, 2>, 12> kEdgeVertex = {
    {{0, 1}, {3, 2}, {4, 5}, {7, 6}, {0, 3}, {1, 2}, {4, 7}, {5, 6}, {0, 4}, {1, 5}, {3, 7}, {2, 6}}};

/// The 32 tetrahedra (thesis 4.2.2), each as one edge along xi, eta and zeta (numbers of kEdgeVertex): its
/// determinant det(e_xi, e_eta, e_zeta) is 1 on the unit cube. Entry 4c is the corner tetrahedron of the
/// vertex at (c&1, c>>1&1, c>>2); entries 4c+1..4c+3 are the edge-path tetrahedra of the 24-tet decomposition
/// whose middle edge runs along eta, xi and zeta.
inline constexpr std::array<std::array<std::uint8_t, 3>, 32> kTetEdge = [] {
    std::array<std::array<std::uint8_t, 3>, 32> tet{};
    for (int c = 0; c < 8; ++c) {
        const int x = c & 1, y = c >> 1 & 1, z = c >> 2;
        const auto xi = [](int a, int b) { return static_cast<std::uint8_t>(a + 2 * b); };
        const auto eta = [](int a, int b) { return static_cast<std::uint8_t>(4 + a + 2 * b); };
        const auto zeta = [](int a, int b) { return static_cast<std::uint8_t>(8 + a + 2 * b); };
        tet[4 * c] = {xi(y, z), eta(x, z), zeta(x, y)};
        tet[4 * c + 1] = {xi(y, z), eta(x, z), zeta(x, 1 - y)};
        tet[4 * c + 2] = {xi(y, z), eta(x, z), zeta(1 - x, y)};
        tet[4 * c + 3] = {xi(y, z), eta(x, 1 - z), zeta(x, y)};
    }
    return tet;
}();

} // namespace hexopt::hex
