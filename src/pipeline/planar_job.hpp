#pragma once

#include "pipeline/mesh_pipeline.hpp"
#include "pipeline/mesh_planar.hpp"

namespace hexopt {

/// Outlines of all files as one slab. Errors: usage (some files are outlines and others not, --planar no, a
/// thickness that is none), those of read_outlines().
Result<Slab> read_outline_slab(const MeshJob& job, Context& context);

/// Refuses what a planar mesh does not use: keys of other stages that are set to anything but their default,
/// for outlines also those of surfaces, for slabs --thickness. Error: usage, with the flag.
Status check_planar_keys(const MeshJob& job, bool has_outlines);

} // namespace hexopt
