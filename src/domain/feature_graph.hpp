#pragma once

#include "core/csr.hpp"
#include "core/types.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// Polygons of a surface: boundary quads with the hanging vertices of their edges inserted, or triangles.
struct SurfacePolygons {
    Csr<Index> vertex;         ///< loop of each polygon, at least 3 vertices
    std::vector<Point> normal; ///< unit; zero where a polygon has no area
    std::vector<Index> patch;  ///< named patch, kNoIndex without a name
};

struct FeatureLimits {
    double feature_angle_deg;
    double corner_turn_deg;
    bool patch_borders;
    /// Edges that are features whatever the angle: vertices, smaller first; sorted.
    std::span<const std::array<Index, 2>> given = {};
};

/// Patches, curves and corners of a polygonal surface. Numbered by rising face (patches) and vertex (the
/// others), so that the same input gives the same numbers.
struct FeatureGraph {
    std::vector<Index> face_patch;
    Index patch_count = 0;
    Csr<Index> curve_vertex;           ///< chain of each curve; a closed one repeats its first vertex
    std::vector<std::uint8_t> closed;  ///< per curve
    std::vector<Index> corner_vertex;  ///< per corner
    std::vector<Index> vertex_patch;   ///< per vertex: of some face there; kNoIndex where no face is
    std::vector<Index> vertex_curve;   ///< per vertex: kNoIndex unless inside a curve (not at its ends)
    std::vector<Index> vertex_corner;  ///< per vertex: kNoIndex unless a corner
    std::vector<std::uint8_t> flipped; ///< per face: 1 where it opposes the first face of its patch
};

/// A feature edge: normals differing by more than feature_angle_deg, borders between named patches, edges
/// that are given, and those that do not have exactly two faces. A corner: a number of feature edges other
/// than 0 and 2, a turn by more than corner_turn_deg, one edge that is given and one that is a feature
/// anyway, or faces that meet in the vertex alone. Neighbours of opposite orientation are recognised by the
/// direction of their common edge.
FeatureGraph compute_feature_graph(std::span<const Point> positions, const SurfacePolygons& polygons,
                                   const FeatureLimits& limits);

} // namespace hexopt
