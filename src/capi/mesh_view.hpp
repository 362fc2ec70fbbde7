#pragma once

#include "capi/context.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt::capi {

/// Copies a caller's mesh and checks all of it: null arrays, ids, finiteness, constraints. Errors: usage
/// (struct, null array), bad_input (contents), cancelled.
Result<HexMesh> copy_mesh(const hexopt_mesh* given, const Context& context);

/// Positions into 3 * positions.size() doubles.
void write_positions(const std::vector<Point>& positions, double* target);

} // namespace hexopt::capi
