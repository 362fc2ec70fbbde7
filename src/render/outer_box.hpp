#pragma once

#include "mesh/topology.hpp"

#include <cstdint>
#include <vector>

namespace hexopt {

/// Of all vertices, model units.
struct Bounds {
    Point low, high;
};
Bounds bounds_of(const HexMesh& mesh);

/// Per boundary face: 1 where it lies in a side of the mesh's bounding box (within 1e-6 of its diagonal).
std::vector<std::uint8_t> find_faces_on_box(const HexMesh& mesh, const Topology& topology);

/// Whether the mesh is that of a flow round a body in a box: boundary faces fill at least 0.9 of at least
/// five sides of its bounding box, and there are others.
bool has_outer_box(const HexMesh& mesh, const Topology& topology);

} // namespace hexopt
