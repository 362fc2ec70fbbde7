#pragma once

#include "domain/narrow_curves.hpp"
#include "mesh/hex_mesh.hpp"
#include "pipeline/mesh_surface.hpp"

#include <optional>

namespace hexopt {

/// find_narrow_curves() as the options say, with the sizes of an octree's leaves, the smallest at a point;
/// nothing where feature lines are given.
NarrowCurves find_narrow_features(const Domain& domain, const HexMesh& octree, const MeshOptions& options);

/// The domain that attempts follow: with those cuts, without those curves; none where that is the domain as
/// it is. Errors: those of split_curves() and drop_curves().
Result<std::optional<Domain>> leave_out(const Domain& domain, const NarrowCurves& narrow, Context& context);

} // namespace hexopt
