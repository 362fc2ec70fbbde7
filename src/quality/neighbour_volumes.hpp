#pragma once

#include "core/parallel.hpp"
#include "mesh/topology.hpp"

#include <array>
#include <span>

namespace hexopt {

/// Larger over smaller volume of the two cells at each interior face; a coarse face counts once for each fine
/// part.
struct NeighbourVolumes {
    std::size_t faces = 0;                  ///< interior faces, of which `undefined` have no ratio
    std::size_t undefined = 0;              ///< a volume is not positive
    double max = 1, mean = 1;               ///< over the defined ones; 1 if there are none
    std::array<std::size_t, 5> histogram{}; ///< up to 2, 4, 8, 16, above
    CellFace worst{kNoIndex, 0};            ///< a face with `max`; kNoIndex if there is none
};

/// volume: one per cell. `topology` must be that of the mesh.
NeighbourVolumes compute_neighbour_volumes(const HexMesh& mesh, const Topology& topology,
                                           std::span<const double> volume, const Parallel& parallel);

} // namespace hexopt
