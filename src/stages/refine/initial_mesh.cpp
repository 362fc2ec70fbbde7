#include "stages/refine/initial_mesh.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

/// How far inside its cell, in fine cells, the surface's extreme plane lies: cells that it cuts keep more
/// than half of their size and move little, on the next two levels too (0.32, 0.36 of a cell).
constexpr double kInset = 0.16;
/// Along axes with at least so many fine cells these are shrunk a little, so that both ends lie as kInset
/// says.
constexpr double kShrinkFrom = 12;

struct AxisGrid {
    double low, step; ///< of the initial mesh
    Index cells;
};

AxisGrid lay_out_axis(double low, double high, double fine, int levels, int margin) {
    const double extent = high - low, block = std::ldexp(1.0, levels);
    const double touched = std::ceil(extent / fine + 2 * kInset); // fine cells that the surface reaches
    if (extent / fine >= kShrinkFrom) fine = extent / (touched - 2 * kInset);
    const double cells = std::ceil((touched + 2 * margin) / block),
                 before = std::floor((cells * block - touched) / 2);
    const double inset = (touched * fine - extent) / 2;
    return {low - inset - before * fine, block * fine, static_cast<Index>(cells)};
}

} // namespace

HexMesh make_box_mesh(const Box& box, const std::array<Index, 3>& cells) {
    HexMesh mesh;
    const auto [n, m, l] = cells;
    for (Index k = 0; k <= l; ++k)
        for (Index j = 0; j <= m; ++j)
            for (Index i = 0; i <= n; ++i) {
                const Point t(i / double(n), j / double(m), k / double(l));
                mesh.positions.push_back(box.low + t * (box.high - box.low));
            }
    for (Index k = 0; k < l; ++k)
        for (Index j = 0; j < m; ++j)
            for (Index i = 0; i < n; ++i) {
                Cell cell;
                for (int v = 0; v < 8; ++v)
                    cell[v] = i + hex::kVertexX[v] +
                              (n + 1) * (j + hex::kVertexY[v] + (m + 1) * (k + hex::kVertexZ[v]));
                mesh.cells.push_back(cell);
            }
    return mesh;
}

HexMesh make_padded_box(const Box& surface, double fine_size, int levels, int margin, bool planar) {
    Box box;
    std::array<Index, 3> cells;
    for (int d = 0; d < 3; ++d) {
        AxisGrid grid = lay_out_axis(surface.low[d], surface.high[d], fine_size, levels, margin);
        if (planar && d == 2) {
            const double extent = surface.high[d] - surface.low[d];
            grid = {surface.low[d] - kInset * extent, (1 + 2 * kInset) * extent, 1};
        }
        box.low[d] = grid.low;
        box.high[d] = grid.low + grid.cells * grid.step;
        cells[d] = grid.cells;
    }
    return make_box_mesh(box, cells);
}

} // namespace hexopt
