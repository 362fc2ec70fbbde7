#pragma once

#include "core/parallel.hpp"
#include "quality/cell_quality.hpp"

#include <vector>

namespace hexopt {

/// Whether a mesh is fit for use, counted over its cells.
struct ValidityCounts {
    std::size_t cells = 0;
    std::size_t nonfinite_cells =
        0; ///< with a coordinate that is not finite; they count as concave and invalid
    std::size_t concave8_cells = 0,
                concave8_tets = 0; ///< with, and number of, corner tetrahedra not positive
    std::size_t concave24_cells = 0, concave24_tets = 0;      ///< the same for the edge-path tetrahedra
    std::size_t concave_cells = 0;                            ///< with a tetrahedron not positive, of all 32
    std::size_t valid = 0, invalid = 0, undecided = 0;        ///< the exact certificate; sum = cells
    double min_scaled_jacobian = 1, mean_scaled_jacobian = 1; ///< 1 for a mesh without cells
    Index worst_cell = kNoIndex;                              ///< first cell with min_scaled_jacobian

    /// All tetrahedra positive and every trilinear map proved valid.
    bool is_valid() const { return concave_cells == 0 && valid == cells; }
};

/// Per-cell validity, index = cell.
std::vector<CellValidity> compute_cell_validities(const HexMesh& mesh, const Parallel& parallel);

ValidityCounts count_validity(const std::vector<CellValidity>& cells, const Parallel& parallel);

/// The counts alone, without keeping the cells. Same bits for any number of threads.
ValidityCounts compute_validity(const HexMesh& mesh, const Parallel& parallel);

} // namespace hexopt
