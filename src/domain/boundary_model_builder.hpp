#pragma once

#include "domain/boundary_model.hpp"
#include "domain/feature_graph.hpp"

namespace hexopt {

/// What a BoundaryModel is assembled from.
struct BoundaryModelParts {
    std::vector<Point> vertices;
    std::vector<std::array<Index, 3>> triangles;
    std::vector<SourceFace> source; ///< per triangle
    /// Where smooth: the last vertices lie inside quads (add_quads); their normals are those of the quad's
    /// corners, weighted.
    struct Inside {
        Quad corners;
        std::array<double, 4> weight;
    };
    std::vector<Inside> inside;
    std::vector<Index> patch; ///< per triangle, 0..patch_count-1; every patch has a triangle
    Index patch_count = 0;
    Csr<Index> curve_vertex;                      ///< as in FeatureGraph
    std::vector<std::array<Index, 2>> curve_ends; ///< corners; kNoIndex where a loop has none
    std::vector<Index> corner_vertex;
    bool smooth = true; ///< false: without normals at vertices, where only distances are asked for
};

/// Vertices of topology.boundary_faces.
std::vector<Quad> boundary_quads(const HexMesh& mesh, const Topology& topology);

/// Error bad_input where there is no boundary or one of its vertices is not finite.
Status check_boundary(const HexMesh& mesh, const Topology& topology);

/// How closely triangles follow the bilinear patch of a quad: what is left between them, at most. Relative to
/// the surface's diagonal; a quad is cut into at most kMaxCuts by kMaxCuts pieces for it.
constexpr double kQuadTolerance_rel = 1e-4;
constexpr int kMaxCuts = 4;

/// Adds the triangles of each quad's bilinear patch with their sources: k by k pieces, four triangles round
/// the centre of each, with the smallest k that keeps them within `tolerance` (model units) of the patch. The
/// inner vertices are new. Returns the largest distance that is left between a patch and its triangles.
double add_quads(std::span<const Quad> quads, double tolerance, BoundaryModelParts& parts);

/// Diagonal of the bounding box of the quads' vertices.
double compute_diagonal(const std::vector<Point>& positions, std::span<const Quad> quads);

/// Takes over patches, curves and corners. Triangles are parts of the graph's faces, as parts.source says.
void add_features(const FeatureGraph& graph, BoundaryModelParts& parts);

/// Error usage where an option is out of range.
Status check_options(const BoundaryOptions& options);

FeatureLimits feature_limits(const BoundaryOptions& options);

class BoundaryModelBuilder {
  public:
    static BoundaryModel assemble(BoundaryModelParts parts);
    /// Binds the vertices of a mesh.
    static void bind(BoundaryModel& model, std::vector<Association> association,
                     std::vector<std::array<Index, 2>> feature_edges, AssociationReport report,
                     double quad_tolerance);

  private:
    static void add_patches(const BoundaryModelParts& parts, BoundaryModel& model, const Box& frame);
    static void add_curves(const BoundaryModelParts& parts, BoundaryModel& model, const Box& frame);
};

} // namespace hexopt
