#pragma once

#include "core/types.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// Triangles of a soup joined to pieces (over edges with two triangles) and clusters of pieces (over edges
/// with more). Triangles of a piece agree in orientation as far as that is possible.
struct SurfacePieces {
    std::vector<std::array<Index, 3>> triangles; ///< merged vertices, as oriented now
    std::vector<std::uint8_t> flipped;           ///< per triangle: 1 where that differs from the input
    std::vector<Index> piece;                    ///< per triangle
    Index piece_count = 0;
    std::vector<Index> cluster; ///< per piece
    Index cluster_count = 0;
    /// Per cluster: 1 where every edge has as many triangles in one direction as in the other, so that the
    /// cluster bounds something.
    std::vector<std::uint8_t> closed;
    std::size_t unorientable_edges = 0;
};

/// Leaves out triangles with two equal vertices and repeated ones. Of those given in one direction only one
/// stays. Of an opposite pair one stays where that closes the surface round it; where it would not, the pair
/// has the same on both sides (two solids that touch) and both go. Returns the numbers of those that stay.
std::vector<Index> drop_repeated(std::span<const std::array<Index, 3>> triangles);

/// triangles: distinct, no vertex twice in one. Each piece keeps the orientation of most of its area.
SurfacePieces find_pieces(std::vector<std::array<Index, 3>> triangles, std::span<const Point> vertices);

} // namespace hexopt
