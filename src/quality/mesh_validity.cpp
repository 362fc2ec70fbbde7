#include "quality/mesh_validity.hpp"

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 2048;

/// Counts of a chunk of cells; the mean holds the sum until finish().
void add_cell(ValidityCounts& counts, const CellValidity& cell, Index number) {
    ++counts.cells;
    counts.concave8_cells += cell.concave8 > 0;
    counts.concave8_tets += cell.concave8;
    counts.concave24_cells += cell.concave24 > 0;
    counts.concave24_tets += cell.concave24;
    counts.concave_cells += cell.is_concave();
    counts.nonfinite_cells += !cell.is_finite;
    counts.valid += cell.validity == Validity::valid;
    counts.invalid += cell.validity == Validity::invalid;
    counts.undecided += cell.validity == Validity::undecided;
    counts.mean_scaled_jacobian += cell.scaled_jacobian;
    if (counts.worst_cell == kNoIndex || cell.scaled_jacobian < counts.min_scaled_jacobian) {
        counts.min_scaled_jacobian = cell.scaled_jacobian;
        counts.worst_cell = number;
    }
}

ValidityCounts combine(ValidityCounts a, const ValidityCounts& b) {
    a.cells += b.cells;
    a.nonfinite_cells += b.nonfinite_cells;
    a.concave8_cells += b.concave8_cells;
    a.concave8_tets += b.concave8_tets;
    a.concave24_cells += b.concave24_cells;
    a.concave24_tets += b.concave24_tets;
    a.concave_cells += b.concave_cells;
    a.valid += b.valid;
    a.invalid += b.invalid;
    a.undecided += b.undecided;
    a.mean_scaled_jacobian += b.mean_scaled_jacobian;
    if (b.worst_cell != kNoIndex &&
        (a.worst_cell == kNoIndex || b.min_scaled_jacobian < a.min_scaled_jacobian)) {
        a.min_scaled_jacobian = b.min_scaled_jacobian;
        a.worst_cell = b.worst_cell;
    }
    return a;
}

template <class CellAt>
ValidityCounts count(std::size_t cells, const Parallel& parallel, const CellAt& cell_at) {
    ValidityCounts zero;
    zero.mean_scaled_jacobian = 0;
    ValidityCounts total = parallel.reduce(
        cells, kChunk, zero,
        [&](std::size_t begin, std::size_t end) {
            ValidityCounts part = zero;
            for (std::size_t c = begin; c < end; ++c) add_cell(part, cell_at(c), static_cast<Index>(c));
            return part;
        },
        combine);
    total.mean_scaled_jacobian = cells ? total.mean_scaled_jacobian / static_cast<double>(cells) : 1;
    return total;
}

} // namespace

std::vector<CellValidity> compute_cell_validities(const HexMesh& mesh, const Parallel& parallel) {
    std::vector<CellValidity> cells(mesh.cell_count());
    parallel.for_each(cells.size(), kChunk,
                      [&](std::size_t c) { cells[c] = compute_cell_validity(cell_points(mesh, c)); });
    return cells;
}

ValidityCounts count_validity(const std::vector<CellValidity>& cells, const Parallel& parallel) {
    return count(cells.size(), parallel, [&](std::size_t c) { return cells[c]; });
}

ValidityCounts compute_validity(const HexMesh& mesh, const Parallel& parallel) {
    return count(mesh.cell_count(), parallel,
                 [&](std::size_t c) { return compute_cell_validity(cell_points(mesh, c)); });
}

} // namespace hexopt
