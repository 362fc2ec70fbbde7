#pragma once

#include "pipeline/mesh_surface.hpp"

namespace hexopt {

/// Refines such that the finished mesh has about as many cells as wanted: as refine(), but sizes are tried
/// with what trimming keeps and, on the first trial, with the buffer layers that fitting leads to. Room for
/// repairs is left: RefineOutput::max_cells is where they would lead too far beyond what is wanted. A given
/// surface size is taken as it is. Errors: as refine(), trim(), fit_boundary() and insert_buffers().
Result<RefineOutput> refine_to_count(const Domain& domain, const MeshOptions& options, Context& context,
                                     LeakPath* leak);

} // namespace hexopt
