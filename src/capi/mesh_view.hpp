#pragma once

#include "capi/context.hpp"
#include "mesh/feature_lines.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/triangle_soup.hpp"

namespace hexopt::capi {

/// Copies a caller's mesh and checks all of it: null arrays, ids, finiteness, constraints. Errors: usage
/// (struct, null array), bad_input (contents), cancelled.
Result<HexMesh> copy_mesh(const hexopt_mesh* given, const Context& context);

/// Copies a caller's surface; the same checks.
Result<TriangleSoup> copy_surface(const hexopt_surface* given);

/// Copies the ends of `count` segments. Errors: usage (null array), bad_input (not finite).
Result<FeatureLines> copy_feature_lines(const double* segments, std::size_t count);

/// Positions into 3 * positions.size() doubles.
void write_positions(const std::vector<Point>& positions, double* target);

} // namespace hexopt::capi
