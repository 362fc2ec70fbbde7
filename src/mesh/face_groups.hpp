#pragma once

#include "mesh/hex_reference.hpp"
#include "mesh/topology.hpp"

#include <algorithm>

namespace hexopt {

/// Faces at each corner of the reference cell.
inline constexpr std::array<std::array<std::uint8_t, 3>, 8> kCornerFace = [] {
    std::array<std::array<std::uint8_t, 3>, 8> faces{};
    for (int k = 0; k < 8; ++k)
        faces[k] = {hex::kVertexX[k], static_cast<std::uint8_t>(2 + hex::kVertexY[k]),
                    static_cast<std::uint8_t>(4 + hex::kVertexZ[k])};
    return faces;
}();

struct KeyedFace {
    std::array<Index, 3> others; ///< the face's vertices but the lowest, sorted
    CellFace face;
    friend auto operator<=>(const KeyedFace&, const KeyedFace&) = default;
};

/// Faces whose lowest vertex is v, sorted by their other vertices, so that faces of equal vertices follow one
/// another. `cells`: those at v. Over all vertices every face of a cell comes up exactly once.
inline void gather_faces(const HexMesh& mesh, std::span<const CellCorner> cells, Index v,
                         std::vector<KeyedFace>& faces) {
    faces.clear();
    for (CellCorner at : cells)
        for (std::uint32_t f : kCornerFace[at.corner]) {
            Quad quad = face_vertices(mesh, {at.cell, f});
            if (std::min({quad[0], quad[1], quad[2], quad[3]}) != v) continue;
            std::sort(quad.begin(), quad.end());
            faces.push_back({{quad[1], quad[2], quad[3]}, {at.cell, f}});
        }
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end()); // a cell may repeat a vertex
}

} // namespace hexopt
