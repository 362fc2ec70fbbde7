#include "pipeline/repair_cells.hpp"

#include "pipeline/cell_boxes.hpp"

#include <algorithm>

namespace hexopt {

namespace {

void mark_ring(const HexMesh& octree, std::vector<char>& marked) {
    std::vector<char> touched(octree.vertex_count(), 0);
    for (Index c = 0; c < octree.cell_count(); ++c)
        if (marked[c])
            for (Index v : octree.cells[c]) touched[v] = 1;
    for (Index c = 0; c < octree.cell_count(); ++c)
        marked[c] = std::any_of(octree.cells[c].begin(), octree.cells[c].end(),
                                [&](Index v) { return touched[v] != 0; });
}

} // namespace

std::vector<Index> find_cells_round(const HexMesh& octree, const HexMesh& mesh, std::span<const Index> cells,
                                    int rings) {
    std::vector<Index> found;
    if (cells.empty() || octree.cells.empty()) return found;
    const CellBoxes boxes(octree);
    std::vector<char> marked(octree.cell_count(), 0);
    for (Index cell : cells)
        for (Index v : mesh.cells[cell]) boxes.visit_at(mesh.positions[v], [&](Index c) { marked[c] = 1; });
    for (int ring = 0; ring < rings; ++ring) mark_ring(octree, marked);
    for (Index c = 0; c < octree.cell_count(); ++c)
        if (marked[c]) found.push_back(c);
    return found;
}

void mark_vertices(const HexMesh& octree, Index cell, std::vector<int>& level) {
    for (Index v : octree.cells[cell]) level[v] = std::max<int>(level[v], octree.level[cell]);
}

std::vector<Index> find_marked(const HexMesh& octree, const std::vector<int>& level) {
    std::vector<Index> cells;
    for (Index c = 0; c < octree.cell_count(); ++c) {
        const Cell& cell = octree.cells[c];
        if (std::any_of(cell.begin(), cell.end(), [&](Index v) { return level[v] >= octree.level[c]; }))
            cells.push_back(c);
    }
    return cells;
}

std::vector<Index> add_ring(const HexMesh& octree, std::span<const Index> cells) {
    std::vector<int> level(octree.vertex_count(), -1);
    for (Index c : cells) mark_vertices(octree, c, level);
    return find_marked(octree, level);
}

} // namespace hexopt
