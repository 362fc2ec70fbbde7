#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/topology.hpp"
#include "stages/optimize/optimize.hpp"

#include <vector>

namespace hexopt {

/// A boundary vertex that was let off what it is bound to.
struct BackedOffVertex {
    Index vertex;
    EntityKind kind; ///< what it is bound to
    Point position;
    double distance; ///< from there, model units
};

struct SettleReport {
    /// Largest of the deviations that were tried, relative to the diagonal; 0: none was needed.
    double deviation_rel = 0;
    std::size_t backed_off_count = 0;        ///< vertices farther off than rounding
    std::vector<BackedOffVertex> backed_off; ///< the farthest 20 of them, the farthest first
};

/// Optimizes a freshly fitted mesh on the surface and features that its vertices are bound to. While cells
/// stay bad, those round them may leave the surface by more and more (3e-4, 1e-3, 3e-3, ... of the diagonal),
/// up to options.max_deviation_rel; all else stays on it. `stats` sums up the runs. Errors: those of
/// optimize(); cancelled leaves in `mesh` the best state so far.
Result<OptimizeStats> settle_mesh(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                                  const OptimizeOptions& options, SettleReport& report, Context& context);

} // namespace hexopt
