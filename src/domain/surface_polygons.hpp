#pragma once

#include "core/result.hpp"
#include "domain/feature_graph.hpp"
#include "mesh/triangle_soup.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// A soup with equal vertices merged and useless triangles left out.
struct CleanSurface {
    std::vector<Point> vertices;
    std::vector<std::array<Index, 3>> triangles;
    std::vector<Index> source; ///< per triangle: its number in the soup
    SurfacePolygons polygons;  ///< the triangles
    std::size_t dropped_triangles = 0, open_edges = 0, nonmanifold_edges = 0;
};

/// Error (bad_input): an id out of range, a coordinate that is not finite, a wrong number of patches.
Status check_soup(const TriangleSoup& soup);

/// Diagonal of the bounding box of all vertices; 0 without any.
double compute_diagonal(const TriangleSoup& soup);

/// For every vertex the first one at exactly the same place.
std::vector<Index> find_first_equal(const std::vector<Point>& positions);

/// Edges between the first of equal vertices, as clean_surface() has them: smaller vertex first, sorted.
std::vector<std::array<Index, 2>> merge_edges(const std::vector<Point>& vertices,
                                              std::span<const std::array<Index, 2>> edges);

/// Checks and cleans a soup. Triangles with two equal vertices and those given twice are dropped. One whose
/// vertices lie on a line is kept, for its neighbours hang together through it, and takes a neighbour's
/// normal. Errors (bad_input): an id out of range, a coordinate that is not finite, a wrong number of
/// patches, no triangle with an area.
Result<CleanSurface> clean_surface(const TriangleSoup& soup);

} // namespace hexopt
