#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/topology.hpp"
#include "quality/distribution.hpp"
#include "quality/mesh_validity.hpp"
#include "quality/neighbour_volumes.hpp"

#include <vector>

namespace hexopt {

struct QualityOptions {
    std::size_t worst_count = 10; ///< cells to list; 0 for none
    bool keep_cells = false;      ///< fill QualityReport::per_cell
};

/// A cell to look at first.
struct ListedCell {
    Index cell;
    Point centre; ///< mean of the corners
    CellQuality quality;
};

/// All figures of a mesh. Lengths in model units, angles in degrees. Cells with a coordinate that is not
/// finite count in `validity` and `scaled_jacobian` (as -1) and are left out of the other distributions.
struct QualityReport {
    std::size_t vertices = 0, cells = 0, hanging_vertices = 0, boundary_faces = 0;
    Point box_min{0}, box_max{0}; ///< of all finite positions
    ValidityCounts validity;

    Distribution scaled_jacobian;
    Histogram scaled_jacobian_histogram{-1, 0.1, 20};
    Distribution min_dihedral, max_dihedral;          ///< least and largest of each cell's 24 angles
    Histogram dihedral_histogram{0, 10, 18};          ///< all angles: the thesis's orthogonality diagram
    Histogram min_dihedral_histogram{0, 10, 18};      ///< least angle of each cell
    Distribution aspect_ratio;                        ///< longest over shortest edge
    double min_edge = 0, max_edge = 0, mean_edge = 0; ///< the mean counts an edge once for each cell
    Distribution volume;
    double total_volume = 0;
    std::size_t nonpositive_volumes = 0;
    NeighbourVolumes neighbour_volumes;

    /// Cells that are concave or not proved valid come first, then by scaled Jacobian and number.
    std::vector<ListedCell> worst;
    std::vector<CellQuality> per_cell; ///< index = cell; empty unless asked for
};

/// Measures a structurally valid mesh; the same bits for any number of threads. `topology` must be that of
/// the mesh. Error: cancelled. Cost: about a second for a million cells on one core, besides cells whose
/// certificate needs subdivision (about 0.2 ms each). Source: thesis 4.2.2, 4.4 for the
/// diagrams.
Result<QualityReport> compute_quality(const HexMesh& mesh, const Topology& topology,
                                      const QualityOptions& options, Context& context);

} // namespace hexopt
