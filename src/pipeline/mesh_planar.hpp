#pragma once

#include "domain/outline_regions.hpp"
#include "domain/outline_solid.hpp"
#include "pipeline/mesh_surface.hpp"

namespace hexopt {

/// The flow in the plane, in memory: choose regions, refine and trim in turns, close the gap to the outlines
/// by a row of cells, relax, refine where that failed or chords leave the outline, extrude, measure. The
/// outcome is as mesh_surface()'s, with `planar`; what belongs to other stages (weld, orientation, buffer,
/// settle) stays empty. options and outcome are in the model's frame (options_in_plane()). Errors: usage,
/// bad_input, out_of_memory, cancelled before the cells were relaxed. checkpoint: as mesh_domain() takes it;
/// the state is kept before each round.
Result<MeshOutcome> mesh_planar(Slab slab, const MeshOptions& options, StageClock& clock, Context& context,
                                Checkpoint* checkpoint = nullptr);

/// The slab that a surface is, where options.planar allows: `yes` makes it an error (bad_input) if it is
/// none; `automatic` takes one that is thinner than a twentieth of its diagonal, and nothing else.
Result<std::optional<Slab>> find_slab(const TriangleSoup& surface, const MeshOptions& options,
                                      StageClock& clock, Context& context);

} // namespace hexopt
