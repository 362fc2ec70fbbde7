#include "quality/mesh_quality.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numeric>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 2048;

/// What is summed while the cells are measured.
struct Sums {
    double edge_length = 0;
    Histogram scaled_jacobian{-1, 0.1, 20}, dihedral{0, 10, 18}, min_dihedral{0, 10, 18};
};

Sums combine(Sums a, const Sums& b) {
    a.edge_length += b.edge_length;
    a.scaled_jacobian.add(b.scaled_jacobian);
    a.dihedral.add(b.dihedral);
    a.min_dihedral.add(b.min_dihedral);
    return a;
}

CellQuality measure(const HexPoints& points, Sums& sums) {
    CellDetails details;
    const CellQuality cell = compute_cell_quality(points, &details);
    sums.scaled_jacobian.add(cell.validity.scaled_jacobian);
    if (!cell.validity.is_finite) return cell;
    sums.min_dihedral.add(cell.min_dihedral);
    for (double angle : details.dihedral) sums.dihedral.add(angle);
    for (double length : details.edge_length) sums.edge_length += length;
    return cell;
}

/// A figure of the finite cells.
template <class Figure>
Distribution distribution_of(const std::vector<CellQuality>& cells, const Figure& figure,
                             std::vector<double>& scratch) {
    scratch.clear();
    for (const CellQuality& cell : cells)
        if (cell.validity.is_finite) scratch.push_back(figure(cell));
    return compute_distribution(scratch);
}

void fill_distributions(QualityReport& report, const std::vector<CellQuality>& cells) {
    std::vector<double> scratch;
    scratch.reserve(cells.size());
    for (const CellQuality& cell : cells) scratch.push_back(cell.validity.scaled_jacobian);
    report.scaled_jacobian = compute_distribution(scratch);
    report.min_dihedral = distribution_of(
        cells, [](const CellQuality& c) { return c.min_dihedral; }, scratch);
    report.max_dihedral = distribution_of(
        cells, [](const CellQuality& c) { return c.max_dihedral; }, scratch);
    report.aspect_ratio = distribution_of(
        cells, [](const CellQuality& c) { return c.aspect_ratio(); }, scratch);
    report.volume = distribution_of(
        cells, [](const CellQuality& c) { return c.volume; }, scratch);
    report.max_edge = distribution_of(
                          cells, [](const CellQuality& c) { return c.max_edge; }, scratch)
                          .max;
    report.min_edge = distribution_of(
                          cells, [](const CellQuality& c) { return c.min_edge; }, scratch)
                          .min;
    report.total_volume = report.volume.mean * static_cast<double>(report.volume.count);
    for (const CellQuality& cell : cells)
        report.nonpositive_volumes += cell.validity.is_finite && !(cell.volume > 0);
}

void fill_box(QualityReport& report, const HexMesh& mesh) {
    bool first = true;
    for (const Point& p : mesh.positions) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
        report.box_min = first ? p : glm::min(report.box_min, p);
        report.box_max = first ? p : glm::max(report.box_max, p);
        first = false;
    }
}

Point centre_of(const HexPoints& points) {
    Point sum(0);
    for (const Point& p : points) sum += p;
    return sum / 8.0;
}

std::vector<ListedCell> list_worst(const HexMesh& mesh, const std::vector<CellQuality>& cells,
                                   std::size_t wanted) {
    std::vector<Index> order(cells.size());
    std::iota(order.begin(), order.end(), Index{0});
    wanted = std::min(wanted, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(wanted), order.end(),
                      [&](Index a, Index b) {
                          const CellValidity &va = cells[a].validity, &vb = cells[b].validity;
                          return is_worse(va, vb) || (!is_worse(vb, va) && a < b);
                      });
    std::vector<ListedCell> worst;
    for (std::size_t i = 0; i < wanted; ++i)
        worst.push_back({order[i], centre_of(cell_points(mesh, order[i])), cells[order[i]]});
    return worst;
}

Error cancelled() { return make_error(ErrorCode::cancelled, "quality", "", "cancelled"); }

} // namespace

Result<QualityReport> compute_quality(const HexMesh& mesh, const Topology& topology,
                                      const QualityOptions& options, Context& context) {
    const Parallel& parallel = context.parallel();
    QualityReport report;
    report.vertices = mesh.vertex_count();
    report.cells = mesh.cell_count();
    report.hanging_vertices = mesh.hanging.count();
    report.boundary_faces = topology.boundary_faces.size();
    fill_box(report, mesh);

    std::vector<CellQuality> cells(mesh.cell_count());
    const Sums sums = parallel.reduce(
        cells.size(), kChunk, Sums{},
        [&](std::size_t begin, std::size_t end) {
            Sums part;
            for (std::size_t c = begin; c < end && !context.is_cancelled(); ++c)
                cells[c] = measure(cell_points(mesh, c), part);
            return part;
        },
        combine);
    if (context.is_cancelled()) return cancelled();
    report.scaled_jacobian_histogram = sums.scaled_jacobian;
    report.dihedral_histogram = sums.dihedral;
    report.min_dihedral_histogram = sums.min_dihedral;

    std::vector<double> volume(cells.size());
    std::vector<CellValidity> validity(cells.size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
        volume[c] = cells[c].volume;
        validity[c] = cells[c].validity;
    }
    report.validity = count_validity(validity, parallel);
    report.neighbour_volumes = compute_neighbour_volumes(mesh, topology, volume, parallel);
    fill_distributions(report, cells);
    if (report.volume.count > 0)
        report.mean_edge = sums.edge_length / (12 * static_cast<double>(report.volume.count));
    report.worst = list_worst(mesh, cells, options.worst_count);
    if (context.is_cancelled()) return cancelled();
    if (options.keep_cells) report.per_cell = std::move(cells);
    return report;
}

} // namespace hexopt
