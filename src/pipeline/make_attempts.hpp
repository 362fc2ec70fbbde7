#pragma once

#include "pipeline/checkpoint.hpp"
#include "pipeline/compute_place.hpp"
#include "pipeline/feature_domains.hpp"
#include "pipeline/mesh_state.hpp"

namespace hexopt {

/// Meshes the octree of `state` on the surface; while cells fail it is refined round them, or features that
/// look like noise there are given up, and meshed anew, options.repairs times. Later attempts count only
/// where fewer cells fail. Goes on from where the state is, to state.best. Cancelled with a best one: that
/// has no stats. Errors: those of begin_attempt() and optimize_attempt() where there is no best one.
Status make_attempts(MeshState& state, FeatureDomains& domains, const MeshOptions& options,
                     const ComputePlace& place, const Saving& saving, StageClock& clock, Context& context,
                     LeakPath* leak);

} // namespace hexopt
