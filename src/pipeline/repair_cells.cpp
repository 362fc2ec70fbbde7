#include "pipeline/repair_cells.hpp"

#include "domain/box_tree.hpp"

#include <algorithm>

namespace hexopt {

namespace {

std::vector<Box> compute_boxes(const HexMesh& mesh) {
    std::vector<Box> boxes(mesh.cell_count());
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (Index v : mesh.cells[c]) boxes[c].add(mesh.positions[v]);
    return boxes;
}

bool contains(const Box& box, const Point& p) {
    for (int k = 0; k < 3; ++k)
        if (p[k] < box.low[k] || p[k] > box.high[k]) return false;
    return true;
}

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
    const std::vector<Box> boxes = compute_boxes(octree);
    Box frame;
    for (const Box& box : boxes) frame.add(box);
    BoxTree tree(frame);
    std::vector<Index> order;
    const Index root = tree.add_tree(boxes, 0, order);
    std::vector<char> marked(octree.cell_count(), 0);
    for (Index cell : cells)
        for (Index v : mesh.cells[cell]) {
            const Point& p = mesh.positions[v];
            tree.visit_near(root, p, 0.0, [&](Index first, Index last) {
                for (Index k = first; k < last; ++k)
                    if (contains(boxes[order[k]], p)) marked[order[k]] = 1;
            });
        }
    for (int ring = 0; ring < rings; ++ring) mark_ring(octree, marked);
    for (Index c = 0; c < octree.cell_count(); ++c)
        if (marked[c]) found.push_back(c);
    return found;
}

} // namespace hexopt
