#include "domain/associate.hpp"
#include "domain/boundary_model_builder.hpp"
#include "domain/boundary_polygons.hpp"
#include "domain/surface_polygons.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace hexopt {

namespace {

constexpr const char* kStage = "boundary";

} // namespace

Status check_boundary(const HexMesh& mesh, const Topology& topology) {
    if (topology.boundary_faces.empty())
        return make_error(ErrorCode::bad_input, kStage, "", "the mesh has no boundary");
    for (CellFace face : topology.boundary_faces)
        for (Index v : face_vertices(mesh, face)) {
            const Point& x = mesh.positions[v];
            if (!std::isfinite(x.x) || !std::isfinite(x.y) || !std::isfinite(x.z))
                return make_error(ErrorCode::bad_input, kStage, fmt::format("vertex {}", v),
                                  "a coordinate of a boundary vertex is not finite");
        }
    return Done{};
}

std::vector<Quad> boundary_quads(const HexMesh& mesh, const Topology& topology) {
    std::vector<Quad> quads;
    quads.reserve(topology.boundary_faces.size());
    for (CellFace face : topology.boundary_faces) quads.push_back(face_vertices(mesh, face));
    return quads;
}

Status check_options(const BoundaryOptions& options) {
    const auto usage = [](const char* reason) { return make_error(ErrorCode::usage, kStage, "", reason); };
    if (!(options.feature_angle_deg >= 0 && options.feature_angle_deg <= 180))
        return usage("the feature angle must lie in 0..180 degrees");
    if (!(options.corner_turn_deg >= 0 && options.corner_turn_deg <= 180))
        return usage("the turn at a corner must lie in 0..180 degrees");
    if (!(options.reach >= 0 && options.reach <= 2)) return usage("the reach must lie in 0..2 edge lengths");
    return Done{};
}

namespace {

std::vector<Association> associate_own(const Topology& topology, const FeatureGraph& graph) {
    std::vector<Association> association(topology.on_boundary.size());
    for (Index v = 0; v < association.size(); ++v) {
        if (!topology.hanging_row.empty() && topology.hanging_row[v] != kNoIndex)
            association[v] = {EntityKind::hanging, kNoIndex};
        else if (graph.vertex_corner[v] != kNoIndex)
            association[v] = {EntityKind::corner, graph.vertex_corner[v]};
        else if (graph.vertex_curve[v] != kNoIndex)
            association[v] = {EntityKind::curve, graph.vertex_curve[v]};
        else if (graph.vertex_patch[v] != kNoIndex)
            association[v] = {EntityKind::patch, graph.vertex_patch[v]};
    }
    return association;
}

std::vector<std::array<Index, 2>> feature_edges(const FeatureGraph& graph) {
    std::vector<std::array<Index, 2>> edges;
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::span<const Index> chain = graph.curve_vertex[c];
        for (std::size_t i = 0; i + 1 < chain.size(); ++i) edges.push_back({chain[i], chain[i + 1]});
    }
    return edges;
}

} // namespace

Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const BoundaryOptions& options, Context& context) {
    if (Status ok = check_options(options); !ok) return ok.error();
    if (Status ok = check_boundary(mesh, topology); !ok) return ok.error();
    const SurfacePolygons polygons = compute_boundary_polygons(mesh, topology);
    const FeatureGraph graph = compute_feature_graph(mesh.positions, polygons, feature_limits(options));
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    BoundaryModelParts parts;
    parts.vertices = mesh.positions;
    const std::vector<Quad> quads = boundary_quads(mesh, topology);
    const double tolerance = kQuadTolerance_rel * compute_diagonal(mesh.positions, quads);
    add_quads(quads, tolerance, parts);
    add_features(graph, parts);
    BoundaryModel model = BoundaryModelBuilder::assemble(std::move(parts));
    BoundaryModelBuilder::bind(model, associate_own(topology, graph), feature_edges(graph), {}, tolerance);
    return model;
}

Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const TriangleSoup& surface, const BoundaryOptions& options,
                                           Context& context) {
    if (Status ok = check_options(options); !ok) return ok.error();
    if (Status ok = check_boundary(mesh, topology); !ok) return ok.error();
    Result<CleanSurface> clean = clean_surface(surface);
    if (!clean) return clean.error();
    const FeatureGraph graph =
        compute_feature_graph(clean->vertices, clean->polygons, feature_limits(options));
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    BoundaryModelParts parts;
    parts.vertices = std::move(clean->vertices);
    parts.triangles = std::move(clean->triangles);
    parts.source.resize(parts.triangles.size());
    std::iota(parts.source.begin(), parts.source.end(), SourceFace{0});
    add_features(graph, parts);
    parts.source = std::move(clean->source);
    BoundaryModel model = BoundaryModelBuilder::assemble(std::move(parts));

    const FeatureGraph mesh_graph = compute_feature_graph(
        mesh.positions, compute_boundary_polygons(mesh, topology), feature_limits(options));
    SurfaceAssociation bound = associate(mesh, topology, mesh_graph, model, options.reach, context);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    bound.report.dropped_triangles = clean->dropped_triangles;
    bound.report.open_edges = clean->open_edges;
    bound.report.nonmanifold_edges = clean->nonmanifold_edges;
    BoundaryModelBuilder::bind(model, std::move(bound.association), std::move(bound.feature_edges),
                               std::move(bound.report), kQuadTolerance_rel * model.diagonal());
    return model;
}

} // namespace hexopt
