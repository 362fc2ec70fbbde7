#pragma once

#include "pipeline/mesh_attempt.hpp"
#include "pipeline/mesh_options.hpp"
#include "pipeline/reach_features.hpp"
#include "pipeline/stage_clock.hpp"

namespace hexopt {

/// The last steps on the surface of a settled mesh, which leave all other vertices where they are:
/// reach_features(), then follow_creases() where the refinement is to keep to a chord error. time_limit_s:
/// for the first; none is left where it is not positive. domain is bound to the mesh, then to the mesh with
/// the corners that were hit; whole: the one that it was made from, whose other corners are given a vertex
/// too where they allow it. Errors: cancelled, the mesh is sound.
Result<ReachReport> finish_surface(MeshAttempt& settled, const Domain& whole, Domain& domain,
                                   const MeshOptions& options, double time_limit_s, StageClock& clock,
                                   Context& context);

} // namespace hexopt
