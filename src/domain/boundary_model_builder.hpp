#pragma once

#include "domain/boundary_model.hpp"
#include "domain/feature_graph.hpp"

namespace hexopt {

/// What a BoundaryModel is assembled from.
struct BoundaryModelParts {
    std::vector<Point> vertices;
    std::vector<std::array<Index, 3>> triangles;
    std::vector<SourceFace> source; ///< per triangle
    std::vector<Index> patch;       ///< per triangle, 0..patch_count-1; every patch has a triangle
    Index patch_count = 0;
    Csr<Index> curve_vertex;                      ///< as in FeatureGraph
    std::vector<std::array<Index, 2>> curve_ends; ///< corners; kNoIndex where a loop has none
    std::vector<Index> corner_vertex;
};

/// Vertices of topology.boundary_faces.
std::vector<Quad> boundary_quads(const HexMesh& mesh, const Topology& topology);

/// Error bad_input where there is no boundary or one of its vertices is not finite.
Status check_boundary(const HexMesh& mesh, const Topology& topology);

/// Adds four triangles round the centre of each quad, which becomes a new vertex, with their sources.
void add_quad_fans(std::span<const Quad> quads, BoundaryModelParts& parts);

/// Takes over patches, curves and corners. Triangles are parts of the graph's faces, as parts.source says.
void add_features(const FeatureGraph& graph, BoundaryModelParts& parts);

FeatureLimits feature_limits(const BoundaryOptions& options);

class BoundaryModelBuilder {
  public:
    static BoundaryModel assemble(BoundaryModelParts parts);
    /// Binds the vertices of a mesh.
    static void bind(BoundaryModel& model, std::vector<Association> association,
                     std::vector<std::array<Index, 2>> feature_edges, AssociationReport report);

  private:
    static void add_patches(const BoundaryModelParts& parts, BoundaryModel& model, const Box& frame);
    static void add_curves(const BoundaryModelParts& parts, BoundaryModel& model, const Box& frame);
};

} // namespace hexopt
