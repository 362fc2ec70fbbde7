#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "pipeline/mesh_options.hpp"

namespace hexopt {

/// Whether the box or the mesh that the user wants to start from is one that can be started from: the cells
/// of a mesh are not turned over, and where nothing but the surface says what is meshed (no seeds) all of it
/// is enclosed: what lies outside would get no cells, and the cells that end there be bent onto the rest. On
/// the sides is enclosed; beyond those of a mesh, half of an edge is. Errors: usage (the box), bad_input
/// (the mesh), with the place.
Status check_initial_mesh(const Domain& domain, const MeshOptions& options, Context& context);

} // namespace hexopt
