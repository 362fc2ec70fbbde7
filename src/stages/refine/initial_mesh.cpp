#include "stages/refine/initial_mesh.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Cells of the initial mesh along the longest side, at least, so that the inside gets coarse cells.
constexpr double kBaseCells = 6;
/// Fine cells between the surface and the end of the box.
constexpr double kMargin = 2;
/// How far inside its cell, in fine cells, the surface's extreme plane lies: cells that it cuts keep more
/// than half of their size and move little, on the next two levels too (0.32, 0.36 of a cell).
constexpr double kInset = 0.16;
/// Along axes with at least so many fine cells these are shrunk a little, so that both ends lie as kInset
/// says.
constexpr double kShrinkFrom = 12;
/// Cells along an axis of the initial mesh: more is taken for a mistake of units.
constexpr double kMostCells = 2000;

Error usage(const std::string& where, const std::string& reason) {
    return make_error(ErrorCode::usage, "refine", where, reason);
}

Box bounding_box(const Domain& domain) {
    Box box;
    for (Index t = 0; t < domain.model.triangle_count(); ++t)
        for (const Point& p : domain.model.triangle(t)) box.add(p);
    return box;
}

struct AxisGrid {
    double low, step; ///< of the initial mesh
    double cells;
};

AxisGrid lay_out_axis(double low, double high, double fine, int levels) {
    const double extent = high - low, block = std::ldexp(1.0, levels);
    const double touched = std::ceil(extent / fine + 2 * kInset); // fine cells that the surface reaches
    if (extent / fine >= kShrinkFrom) fine = extent / (touched - 2 * kInset);
    const double cells = std::ceil((touched + 2 * kMargin) / block);
    const double before = std::floor((cells * block - touched) / 2);
    const double inset = (touched * fine - extent) / 2;
    return {low - inset - before * fine, block * fine, cells};
}

/// Box round the surface such that cells of `fine` size, after `levels` halvings, lie well at its ends.
Result<HexMesh> make_padded_box(const Box& surface, double fine, int levels, bool planar) {
    Box box;
    std::array<Index, 3> cells = {1, 1, 1};
    for (int d = 0; d < 3; ++d) {
        box.low[d] = surface.low[d];
        box.high[d] = surface.high[d];
        if (planar && d == 2) continue;
        const AxisGrid grid = lay_out_axis(surface.low[d], surface.high[d], fine, levels);
        if (!(grid.cells <= kMostCells))
            return usage("base_size",
                         "is too small for the surface's box: more than 2000 cells along an axis");
        box.low[d] = grid.low;
        box.high[d] = grid.low + grid.cells * grid.step;
        cells[d] = static_cast<Index>(grid.cells);
    }
    return make_box_mesh(box, cells);
}

/// The user's box, or the surface's where only the counts are given.
Result<HexMesh> make_given_box(const Box& surface, const InitialMeshOptions& initial, bool planar) {
    const Point extent = surface.high - surface.low;
    const double longest = std::max({extent.x, extent.y, extent.z});
    Box box = surface;
    // Uneven, so that planes of the surface are unlikely to coincide with planes of cells.
    for (int d = 0; d < (planar ? 2 : 3); ++d) {
        box.low[d] -= 0.0317 * longest;
        box.high[d] += 0.0411 * longest;
    }
    if (initial.box) box = *initial.box;
    const Point size = box.high - box.low;
    if (!(std::min({size.x, size.y, size.z}) > 0)) return usage("box", "has no volume");
    std::array<Index, 3> cells = initial.cells;
    if (cells == std::array<Index, 3>{0, 0, 0}) {
        const double base = initial.base_size > 0 ? initial.base_size : longest / kBaseCells;
        for (int d = 0; d < 3; ++d) {
            const double count = planar && d == 2 ? 1 : std::max(1.0, std::ceil(size[d] / base - 1e-9));
            if (!(count <= kMostCells))
                return usage("base_size", "is too small for the box: more than 2000 cells along an axis");
            cells[d] = static_cast<Index>(count);
        }
    }
    return make_box_mesh(box, cells);
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

Result<HexMesh> make_initial_mesh(const Domain& domain, const RefineOptions& options,
                                  const TargetSize& target) {
    const InitialMeshOptions& initial = options.initial;
    if (initial.mesh) return *initial.mesh;
    const Box bounds = bounding_box(domain);
    const Point extent = bounds.high - bounds.low;
    const double longest = std::max({extent.x, extent.y, extent.z});
    if (!(longest > 0) || (options.planar && !(extent.z > 0))) return usage("surface", "has no extent");
    const auto missing = std::count(initial.cells.begin(), initial.cells.end(), 0u);
    if (missing > 0 && missing < 3) return usage("cells", "give the number of cells along all three axes");
    if (std::any_of(initial.cells.begin(), initial.cells.end(), [](Index n) { return n > kMostCells; }))
        return usage("cells", "more than 2000 along an axis");
    if (initial.box || missing == 0) return make_given_box(bounds, initial, options.planar);
    const double base = initial.base_size > 0 ? initial.base_size : longest / kBaseCells;
    if (target.level >= 0)
        return make_padded_box(bounds, std::ldexp(base, -target.level), target.level, options.planar);
    // A given base is kept to, else it follows from the target.
    const double halvings = std::log2(base / target.size);
    const int levels =
        std::clamp(static_cast<int>(initial.base_size > 0 ? std::ceil(halvings - 1e-9) : halvings), 0, 20);
    return make_padded_box(bounds, initial.base_size > 0 ? std::ldexp(base, -levels) : target.size, levels,
                           options.planar);
}

double first_size(const Domain& domain, double cells, bool planar) {
    // Cells per square of the surface's size: those that the surface cuts and what lies behind them.
    constexpr double kPerSquare = 4, kPerEdge = 12;
    double area = 0;
    const Box bounds = bounding_box(domain);
    for (Index t = 0; t < domain.model.triangle_count(); ++t) {
        const auto& x = domain.model.triangle(t);
        const Point cross = glm::cross(x[1] - x[0], x[2] - x[0]);
        const double length = glm::length(cross);
        if (!planar || std::abs(cross.z) < 0.99 * length) area += length / 2;
    }
    if (!planar) return std::sqrt(kPerSquare * area / cells);
    const double thickness = bounds.high.z - bounds.low.z;
    return thickness > 0 ? kPerEdge * area / thickness / cells : 0;
}

} // namespace hexopt
