#pragma once

#include "mesh/plane_frame.hpp"
#include "pipeline/mesh_options.hpp"

namespace hexopt {

/// Options in model coordinates as the flow in a plane takes them, in its frame: farfield, seeds, initial box
/// and counts of cells; regions of refinement stay in the model, which refinement is told the frame of.
/// Errors (usage): a farfield with bounds across the plane; boxes and counts along the model's axes where the
/// plane is turned.
Result<MeshOptions> options_in_plane(const MeshOptions& options, const PlaneFrame& frame);

} // namespace hexopt
