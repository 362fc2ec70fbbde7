#pragma once

#include "mesh/colouring.hpp"
#include "mesh/remap.hpp"
#include "mesh/topology.hpp"

namespace hexopt {

/// Numbers cells along the Z-order curve through their centres and vertices in the order in which cells first
/// use them (unused ones last): neighbours in space lie near each other in memory. For meshes whose positions
/// mean something; O(n log n).
Remap compute_spatial_order(const HexMesh& mesh);

/// Reverse Cuthill-McKee over the cells (neighbours share a vertex), vertices in the order of first use.
/// Needs no positions, so it also serves scrambled meshes. Source: Cuthill, McKee 1969; George 1971.
Remap compute_bandwidth_order(const HexMesh& mesh, const Topology& topology);

/// Numbers vertices colour by colour, those without a colour last, each in the old order; cells stay.
Remap compute_colour_order(const HexMesh& mesh, const Colouring& colouring);

} // namespace hexopt
