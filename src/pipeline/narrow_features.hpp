#pragma once

#include "domain/narrow_curves.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt {

/// find_narrow_curves() with the sizes of an octree's leaves, the smallest at a point.
NarrowCurves find_narrow_features(const Domain& domain, const HexMesh& octree, const NarrowOptions& options);

} // namespace hexopt
