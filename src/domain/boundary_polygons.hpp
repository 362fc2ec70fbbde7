#pragma once

#include "domain/feature_graph.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

namespace hexopt {

/// One polygon for each of topology.boundary_faces: its four vertices and, between them, the hanging vertices
/// that split an edge for the finer neighbours. Normals: direction of the quad's vector area.
SurfacePolygons compute_boundary_polygons(const HexMesh& mesh, const Topology& topology);

/// Named patch of each quad, kNoIndex where mesh.boundary does not list it.
std::vector<Index> find_named_patches(const HexMesh& mesh, std::span<const Quad> quads);

} // namespace hexopt
