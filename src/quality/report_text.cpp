#include "quality/report_text.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr int kBarWidth = 40;

std::string histogram_lines(const Histogram& h, const char* format_of_range) {
    std::string text;
    const std::size_t total = h.total(), most = *std::max_element(h.count.begin(), h.count.end());
    if (total == 0) return text;
    std::size_t first = 0, last = h.count.size() - 1;
    while (h.count[first] == 0) ++first;
    while (h.count[last] == 0) --last;
    for (std::size_t i = first; i <= last; ++i) {
        const double from = h.low + static_cast<double>(i) * h.width;
        // A bin with anything in it shows at least one mark.
        const std::size_t bar = (h.count[i] * kBarWidth + most - 1) / most;
        text += fmt::format(fmt::runtime(format_of_range), from, from + h.width);
        text += fmt::format(" {:>10} {:>6.2f} %  {}\n", h.count[i],
                            100.0 * static_cast<double>(h.count[i]) / static_cast<double>(total),
                            std::string(bar, '#'));
    }
    return text;
}

std::string distribution_line(const char* name, const Distribution& d) {
    return fmt::format(
        "{:<18} min {:<10.4g} 1% {:<10.4g} 50% {:<10.4g} 99% {:<10.4g} max {:<10.4g} mean {:.4g}\n", name,
        d.min, d.p1, d.p50, d.p99, d.max, d.mean);
}

std::string worst_lines(const std::vector<ListedCell>& worst) {
    if (worst.empty()) return {};
    std::string text =
        fmt::format("worst cells\n{:>10} {:>9} {:>5} {:>5} {:<9} {:>8} {:>8} {:>9}  {}\n", "cell", "sj",
                    "bad8", "bad24", "jacobian", "min deg", "max deg", "aspect", "centre");
    for (const ListedCell& w : worst) {
        const CellQuality& q = w.quality;
        text += fmt::format(
            "{:>10} {:>9.5f} {:>5} {:>5} {:<9} {:>8.2f} {:>8.2f} {:>9.4g}  {:.6g} {:.6g} {:.6g}\n", w.cell,
            q.validity.scaled_jacobian, q.validity.concave8, q.validity.concave24,
            name_of(q.validity.validity), q.min_dihedral, q.max_dihedral, q.aspect_ratio(), w.centre.x,
            w.centre.y, w.centre.z);
    }
    return text;
}

} // namespace

std::string to_line(const ValidityCounts& v) {
    return fmt::format("{} cells, concave {} (8-tet) / {} (24-tet), certificate {} valid / {} invalid / {} "
                       "undecided, scaled Jacobian min {:.4f} mean {:.4f}",
                       v.cells, v.concave8_cells, v.concave24_cells, v.valid, v.invalid, v.undecided,
                       v.min_scaled_jacobian, v.mean_scaled_jacobian);
}

std::string to_text(const QualityReport& r) {
    const ValidityCounts& v = r.validity;
    const NeighbourVolumes& n = r.neighbour_volumes;
    std::string text = fmt::format("{} cells, {} vertices ({} hanging), {} boundary quads\n", r.cells,
                                   r.vertices, r.hanging_vertices, r.boundary_faces);
    text += fmt::format("box                {:.6g} {:.6g} {:.6g}  to  {:.6g} {:.6g} {:.6g}\n", r.box_min.x,
                        r.box_min.y, r.box_min.z, r.box_max.x, r.box_max.y, r.box_max.z);
    text += fmt::format("validity           {}\n", v.is_valid() ? "every cell is valid" : "NOT VALID");
    if (v.nonfinite_cells)
        text += fmt::format("  {} cells have coordinates that are not finite\n", v.nonfinite_cells);
    text += fmt::format("  8-tet concave    {} cells, {} tetrahedra\n", v.concave8_cells, v.concave8_tets);
    text += fmt::format("  24-tet concave   {} cells, {} tetrahedra\n", v.concave24_cells, v.concave24_tets);
    text += fmt::format("  trilinear map    {} valid, {} invalid, {} undecided\n", v.valid, v.invalid,
                        v.undecided);
    text += distribution_line("scaled Jacobian", r.scaled_jacobian);
    text += distribution_line("min dihedral, deg", r.min_dihedral);
    text += distribution_line("max dihedral, deg", r.max_dihedral);
    text += distribution_line("aspect ratio", r.aspect_ratio);
    text += distribution_line("volume", r.volume);
    text +=
        fmt::format("  total volume {:.10g}, {} cells not positive\n", r.total_volume, r.nonpositive_volumes);
    text += fmt::format("edge length        min {:.4g} mean {:.4g} max {:.4g}\n", r.min_edge, r.mean_edge,
                        r.max_edge);
    text += fmt::format(
        "neighbour volumes  {} faces, ratio max {:.4g} mean {:.4g}; up to 2: {}, 4: {}, 8: {}, 16: {}, "
        "above: {}, undefined: {}\n",
        n.faces, n.max, n.mean, n.histogram[0], n.histogram[1], n.histogram[2], n.histogram[3],
        n.histogram[4], n.undefined);
    text +=
        "scaled Jacobian, cells\n" + histogram_lines(r.scaled_jacobian_histogram, "  {:>5.1f} .. {:<5.1f}");
    text += "dihedral angles in degrees, all 24 of each cell\n" +
            histogram_lines(r.dihedral_histogram, "  {:>5.0f} .. {:<5.0f}");
    text += "least dihedral angle in degrees, cells\n" +
            histogram_lines(r.min_dihedral_histogram, "  {:>5.0f} .. {:<5.0f}");
    return text + worst_lines(r.worst);
}

} // namespace hexopt
