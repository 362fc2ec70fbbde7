#pragma once

#include "mesh/hex_mesh.hpp"
#include "stages/planar/quad_mesh.hpp"

namespace hexopt {

/// Names of the patches that extrude() makes, and the planes, z.
struct ExtrudeOptions {
    double low = 0, high = 1;
    std::vector<std::string> wall_names; ///< QuadMesh::WallEdge::patch counts in these
    std::string low_name = "back", high_name = "front";
};

/// The mesh as hexahedra one cell thick: vertices 0..n-1 in the plane z = low, above each the one of number
/// n more in z = high with the same x and y bit for bit; cells in the order of the quads. Patches: the walls'
/// names, then low_name and high_name.
HexMesh extrude(const QuadMesh& mesh, const ExtrudeOptions& options);

} // namespace hexopt
