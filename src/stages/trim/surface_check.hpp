#pragma once

#include "mesh/topology.hpp"

namespace hexopt::trimming {

struct SurfaceFaults {
    std::size_t open_edges = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0;
};

/// Looks at the mesh's boundary as polygons, hanging vertices inserted: each edge must have two polygons that
/// run along it in opposite directions, the polygons round a vertex must form one fan.
SurfaceFaults check_surface(const HexMesh& mesh, const Topology& topology);

} // namespace hexopt::trimming
