#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "domain/fitted_mesh.hpp"
#include "mesh/topology.hpp"
#include "pipeline/entity_map.hpp"
#include "pipeline/mesh_surface.hpp"
#include "pipeline/octree_store.hpp"
#include "pipeline/settle_mesh.hpp"
#include "pipeline/trim_rounds.hpp"
#include "stages/optimize/mesh_measure.hpp"

#include <optional>
#include <vector>

namespace hexopt {

/// One way through the stages from an octree to a mesh on the surface.
struct MeshAttempt {
    FittedMesh fitted; ///< its mesh after the optimizer, on the surface wherever it can be
    Topology topology;
    std::vector<Point> start;           ///< positions before the optimizer
    std::optional<OptimizeStats> stats; ///< none where cancelled
    TrimReport trim;
    FitReport fit;
    std::optional<BufferReport> buffer;
    /// Cells that are not certified valid, concave, or have a face where the boundary touches or crosses
    /// itself; ascending.
    std::vector<Index> failed;
    std::vector<Index> low;           ///< others below kLowScaledJacobian, a reason to mesh anew; ascending
    std::optional<SettleTrial> trial; ///< where settling it was tried; only saves time
    std::vector<Index> dropped;       ///< curves of the whole domain that this attempt's has not; rising
};

/// What attempts on one octree share.
struct AttemptCounts {
    TrimRounds trims;
    std::optional<TrimOutput> trimmed; ///< of the octree as it is, where that is known: for the first attempt
    std::optional<FitOutput> fitted;   ///< the same
    int fit_rounds = 0;                ///< times that the boundary was fitted
    int fit_repairs = 0;               ///< times that cells at features were refined
    double optimize_s = 0; ///< wall clock of the optimizer, which options.optimize.time_limit_s bounds in all

    double optimize_s_left(const MeshOptions& options) const {
        return options.optimize.time_limit_s - optimize_s;
    }
};

/// What an attempt goes on from.
struct EarlierAttempt {
    const MeshAttempt& attempt;
    EntityMap entities; ///< of its domain in that of the one that goes on
};

/// Trims `octree` at `whole`, fits its boundary to `domain`, which is the whole one or has fewer curves
/// (refining where features could not be captured, as often as options.fit_repairs leaves) and inserts
/// buffers. `octree` is left as it was trimmed last, put away. Errors: bad_input (*leak gets the path where
/// the surface leaks), out_of_memory, cancelled.
Result<MeshAttempt> begin_attempt(OctreeStore& octree, const Domain& whole, const Domain& domain,
                                  const MeshOptions& options, AttemptCounts& counts, StageClock& clock,
                                  Context& context, LeakPath* leak);

/// Binds domain.model to what begin_attempt() made, optimizes it on the surface (on `place`) and finds what
/// failed. earlier: goes on from what that attempt came to wherever the two are the same.
/// Cancelled: no error but an attempt without stats. Errors: out_of_memory.
Status optimize_attempt(MeshAttempt& attempt, const std::optional<EarlierAttempt>& earlier, Domain& domain,
                        const MeshOptions& options, const ComputePlace& place, AttemptCounts& counts,
                        StageClock& clock, Context& context);

/// Binds domain.model to the vertices of a fitted mesh.
void bind_surface(Domain& domain, const FittedMesh& fitted);

/// Finds attempt.failed and attempt.low. Returns how many both are.
std::size_t grade_cells(MeshAttempt& attempt, const Parallel& parallel);

} // namespace hexopt
