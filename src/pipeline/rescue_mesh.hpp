#pragma once

#include "pipeline/compute_place.hpp"
#include "pipeline/mesh_state.hpp"

namespace hexopt {

/// Settles an optimized attempt (settle_mesh()) within what is left of the optimizer's time, and finds what
/// fails then. domain.model is bound to it. Errors: those of settle_mesh().
Status settle_attempt(MeshAttempt& attempt, Domain& domain, const MeshOptions& options, AttemptCounts& counts,
                      SettleReport& report, StageClock& clock, Context& context);

/// Meshes anew where cells of the settled state.best fail: the octree refined round them, twice, farther the
/// second time, as far as options.refine.max_cells and three times its first cells allow; at last without
/// buffer layers, whose cells then can go back to those of the octree. What fails least is kept in state.best
/// and state.settle, and domain.model is bound to it; state.attempts gets what was tried. Nothing is done
/// where no cell fails, options.repairs is 0 or the optimizer's time is spent. Cancelled: state.best keeps
/// its mesh and has no stats. Errors: out_of_memory.
Status rescue_mesh(MeshState& state, const Domain& whole, Domain& domain, const MeshOptions& options,
                   const ComputePlace& place, StageClock& clock, Context& context);

} // namespace hexopt
