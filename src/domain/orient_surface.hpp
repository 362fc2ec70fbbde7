#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

namespace hexopt {

/// What orient_surface() found and did.
struct OrientationReport {
    std::size_t flipped_triangles = 0;  ///< now the other way round
    std::size_t repeated_triangles = 0; ///< left out: given before, or twice with the inside on both sides
    std::size_t sheet_triangles = 0;    ///< left out: parts with the inside on both sides (fins, partitions)
    std::size_t pieces = 0;             ///< parts whose triangles hang together over manifold edges
    std::size_t bodies = 0;             ///< closed surfaces that bound from outside
    std::size_t cavities = 0;           ///< closed surfaces inside others
    std::size_t open_pieces = 0;        ///< pieces that bound nothing by themselves: oriented by rays
    std::size_t unorientable_edges = 0; ///< where neighbours cannot agree (Moebius strips)
};

struct OrientedSurface {
    TriangleSoup soup; ///< vertices, patches and names as given; triangles point away from the inside
    OrientationReport report;
};

/// Makes a soup's triangles point outwards, away from what is to be meshed: neighbours are made to agree;
/// closed surfaces bound their inside, those wholly inside another are cavities (an outer box round a body
/// leaves the flow's domain), and those that cross are a union; pieces that are not closed are oriented by
/// how often random rays from either side meet the rest (after Takayama, Jacobson, Kavan, Sorkine-Hornung
/// 2014, A simple method for correcting facet orientations in polygon meshes based on ray casting).
/// Deterministic. Errors: bad_input (an id out of range, a coordinate that is not finite, no triangle with
/// an area); cancelled.
Result<OrientedSurface> orient_surface(const TriangleSoup& soup, Context& context);

} // namespace hexopt
