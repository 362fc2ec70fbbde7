#pragma once

#include "core/types.hpp"

#include <array>
#include <string>
#include <vector>

namespace hexopt {

using Cell = std::array<Index, 8>; ///< vertices of a hexahedron in VTK order
using Quad = std::array<Index, 4>; ///< vertices of a quadrilateral, seen from outside counter-clockwise

/// Hanging vertices and what they depend on: x[vertex[i]] = sum of weight[k] * x[master[k]] over
/// k in [offset[i], offset[i+1]). Closed: no master is itself hanging. Weights of a row are positive and sum
/// to 1. Rows are sorted by vertex, masters within a row too.
struct Hanging {
    std::vector<Index> vertex;
    std::vector<std::size_t> offset = {0};
    std::vector<Index> master;
    std::vector<double> weight;

    std::size_t count() const { return vertex.size(); }
    bool empty() const { return vertex.empty(); }
    void clear() { *this = Hanging{}; }
};

/// A patch of the boundary: quads that belong together (a CAD face, an STL solid, a physical group).
struct BoundaryQuad {
    Quad vertices;
    Index patch; ///< index into HexMesh::patch_names
};

/// All-hexahedral mesh, conforming or with hanging nodes. Plain arrays; whoever changes cells, hanging or the
/// number of vertices raises `revision`, which derived data is stamped with.
struct HexMesh {
    std::vector<Point> positions; ///< model units
    std::vector<Cell> cells;
    std::vector<std::uint8_t> level; ///< refinement level of each cell; empty where unknown
    Hanging hanging;
    std::vector<BoundaryQuad> boundary; ///< quads with a patch, where the input names them; may be empty
    std::vector<std::string> patch_names;
    std::uint64_t revision = 0;

    std::size_t vertex_count() const { return positions.size(); }
    std::size_t cell_count() const { return cells.size(); }
};

} // namespace hexopt
