#include "stages/refine/default_size.hpp"

#include "stages/refine/initial_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Cells of the initial mesh along the longest side, at least: so many levels are left to the interior.
constexpr double kBaseCells = 6;
/// Fine cells between the surface and the end of the box.
constexpr int kMargin = 2;
/// Cells of a mesh refined towards a surface, per square of the surface's cell size: those that the surface
/// cuts, and the coarser ones behind them.
constexpr double kCellsPerSquare = 4;

Box bounding_box(const Domain& domain) {
    Box box;
    for (Index t = 0; t < domain.model.triangle_count(); ++t)
        for (const Point& p : domain.model.triangle(t)) box.add(p);
    return box;
}

Error usage(const std::string& where, const std::string& reason) {
    return make_error(ErrorCode::usage, "refine", where, reason);
}

} // namespace

double surface_area(const Domain& domain) {
    double area = 0;
    for (Index t = 0; t < domain.model.triangle_count(); ++t) {
        const auto& x = domain.model.triangle(t);
        area += glm::length(glm::cross(x[1] - x[0], x[2] - x[0])) / 2;
    }
    return area;
}

Result<Start> choose_start(const Domain& domain, const RefineOptions& options) {
    const InitialMeshOptions& initial = options.initial;
    const Box bounds = bounding_box(domain);
    const Point extent = bounds.high - bounds.low;
    const double longest = std::max({extent.x, extent.y, extent.z});
    if (!(longest > 0)) return usage("surface", "has no extent");
    Start start;
    start.surface = options.surface;
    if (!start.surface.is_given())
        start.surface.size = std::sqrt(kCellsPerSquare * surface_area(domain) / options.target_cells);
    if (initial.mesh) {
        start.mesh = *initial.mesh;
        return start;
    }
    const bool counted = initial.cells != std::array<Index, 3>{0, 0, 0};
    if (counted && std::count(initial.cells.begin(), initial.cells.end(), 0u) > 0)
        return usage("cells", "give the number of cells along all three axes");
    if (initial.box || counted) {
        Box box = initial.box ? *initial.box : bounds;
        if (!initial.box) {
            // Uneven, so that planes of the surface are unlikely to coincide with planes of cells.
            box.low -= Point(0.0317 * longest);
            box.high += Point(0.0411 * longest);
        }
        const Point size = box.high - box.low;
        if (!(std::min({size.x, size.y, size.z}) > 0)) return usage("box", "has no volume");
        std::array<Index, 3> cells = initial.cells;
        const double base = initial.base_size > 0 ? initial.base_size : longest / kBaseCells;
        for (int d = 0; d < 3 && !counted; ++d)
            cells[d] = static_cast<Index>(std::clamp(std::round(size[d] / base), 1.0, 2000.0));
        start.mesh = make_box_mesh(box, cells);
        return start;
    }
    const double base = initial.base_size > 0 ? initial.base_size : longest / kBaseCells;
    double fine = start.surface.size;
    int levels = start.surface.level;
    if (levels < 0)
        levels =
            std::max(0, static_cast<int>(initial.base_size > 0 ? std::ceil(std::log2(base / fine) - 1e-9)
                                                               : std::floor(std::log2(base / fine) + 1e-9)));
    if (start.surface.level >= 0 || initial.base_size > 0) fine = std::ldexp(base, -levels);
    start.mesh = make_padded_box(bounds, fine, levels, kMargin, options.planar);
    return start;
}

} // namespace hexopt
