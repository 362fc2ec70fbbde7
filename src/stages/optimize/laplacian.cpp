#include "stages/optimize/laplacian.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>

namespace hexopt {

namespace {

/// The three corners that a corner of the reference hexahedron shares an edge with.
constexpr std::array<std::array<std::uint8_t, 3>, 8> kCornerNeighbours = [] {
    std::array<std::array<std::uint8_t, 3>, 8> neighbours{};
    for (int v = 0; v < 8; ++v) {
        const int x = hex::kVertexX[v], y = hex::kVertexY[v], z = hex::kVertexZ[v];
        neighbours[v] = {static_cast<std::uint8_t>(hex::vertex_at(1 - x, y, z)),
                         static_cast<std::uint8_t>(hex::vertex_at(x, 1 - y, z)),
                         static_cast<std::uint8_t>(hex::vertex_at(x, y, 1 - z))};
    }
    return neighbours;
}();

struct Neighbour {
    Index vertex;
    double length;
};

} // namespace

Point laplacian_point(const HexMesh& mesh, const Topology& topology, std::span<const Point> positions,
                      const CellTargets& targets, Index vertex) {
    std::vector<Neighbour> neighbours;
    neighbours.reserve(24);
    for (CellCorner corner : topology.vertex_cell[vertex])
        for (std::uint8_t other : kCornerNeighbours[corner.corner])
            neighbours.push_back({mesh.cells[corner.cell][other], targets.length[corner.cell]});
    // Stable: cells come by rising number, so that sums do not depend on the sort.
    std::stable_sort(neighbours.begin(), neighbours.end(),
                     [](const Neighbour& a, const Neighbour& b) { return a.vertex < b.vertex; });
    Point sum(0);
    double total = 0;
    for (std::size_t i = 0; i < neighbours.size();) {
        std::size_t end = i;
        double length = 0;
        for (; end < neighbours.size() && neighbours[end].vertex == neighbours[i].vertex; ++end)
            length += neighbours[end].length;
        const double weight = static_cast<double>(end - i) / length;
        sum += weight * positions[neighbours[i].vertex];
        total += weight;
        i = end;
    }
    return total > 0 ? sum / total : positions[vertex];
}

} // namespace hexopt
