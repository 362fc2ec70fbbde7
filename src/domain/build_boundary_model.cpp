#include "domain/associate.hpp"
#include "domain/boundary_model_builder.hpp"
#include "domain/boundary_polygons.hpp"
#include "domain/follow_lines.hpp"
#include "domain/insert_features.hpp"
#include "domain/surface_polygons.hpp"

#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
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

Status check_given(const GivenFeatures& given) {
    if (given.reach_rel >= 0 && given.reach_rel <= 0.01) return Done{};
    return make_error(ErrorCode::usage, kStage, "", "the reach of feature lines must lie in 0..0.01");
}

std::string place_of(const FollowedLines::Gap& gap) {
    const std::string at = fmt::format("({:.6g}, {:.6g}, {:.6g})", gap.place.x, gap.place.y, gap.place.z);
    return gap.lines->file.empty() ? at : gap.lines->file + " near " + at;
}

Error refuse(const FollowedLines::Gap& gap, double reach) {
    return Error{
        ErrorCode::bad_input,
        "features",
        place_of(gap),
        {gap.at_end ? "a line ends where the mesh's boundary has no vertex"
                    : "no edges of the mesh's boundary follow the line from there",
         fmt::format("vertices must lie within {:.3g} of it (--features-reach, of the diagonal): a mesh "
                     "is not cut along lines, as a surface is",
                     reach)}};
}

/// The mesh's edges along given lines. A vertex may be `reach` (model units) from a line that it is on, or
/// `share` of the edges round it where that is more.
Result<FollowedLines> follow(std::span<const FeatureLines> lines, const HexMesh& mesh,
                             const SurfacePolygons& polygons, double reach, double share,
                             const Context& context) {
    if (lines.empty()) return FollowedLines{};
    std::vector<double> length(mesh.vertex_count(), 0), reaches(mesh.vertex_count(), reach);
    std::vector<Index> count(mesh.vertex_count(), 0);
    for (std::size_t f = 0; f < polygons.vertex.rows(); ++f) {
        const std::span<const Index> loop = polygons.vertex[f];
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Index a = loop[k], b = loop[(k + 1) % loop.size()];
            const double edge = glm::distance(mesh.positions[a], mesh.positions[b]);
            for (Index v : {a, b}) length[v] += edge, ++count[v];
        }
    }
    for (Index v = 0; v < reaches.size(); ++v)
        if (count[v] > 0) reaches[v] = std::max(reach, share * length[v] / count[v]);
    return follow_lines(mesh.positions, polygons, lines, reaches, context);
}

} // namespace

Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const BoundaryOptions& options, Context& context,
                                           const GivenFeatures& given) {
    if (Status ok = check_options(options); !ok) return ok.error();
    if (Status ok = check_given(given); !ok) return ok.error();
    if (Status ok = check_boundary(mesh, topology); !ok) return ok.error();
    const SurfacePolygons polygons = compute_boundary_polygons(mesh, topology);
    const std::vector<Quad> quads = boundary_quads(mesh, topology);
    const double diagonal = compute_diagonal(mesh.positions, quads);
    const double reach = given.reach_rel * diagonal;
    auto followed = follow(given.lines, mesh, polygons, reach, 0, context);
    if (!followed) return followed.error();
    if (!followed->gaps.empty()) return refuse(followed->gaps.front(), reach);
    FeatureLimits limits = feature_limits(options);
    limits.given = followed->edges;
    const FeatureGraph graph = compute_feature_graph(mesh.positions, polygons, limits);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    BoundaryModelParts parts;
    parts.vertices = mesh.positions;
    const double tolerance = kQuadTolerance_rel * diagonal;
    add_quads(quads, tolerance, parts);
    add_features(graph, parts);
    BoundaryModel model = BoundaryModelBuilder::assemble(std::move(parts));
    BoundaryModelBuilder::bind(model, associate_own(topology, graph), feature_edges(graph), {}, tolerance);
    return model;
}

Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const TriangleSoup& surface, const BoundaryOptions& options,
                                           Context& context, const GivenFeatures& given) {
    if (Status ok = check_options(options); !ok) return ok.error();
    if (Status ok = check_given(given); !ok) return ok.error();
    if (Status ok = check_boundary(mesh, topology); !ok) return ok.error();
    const double reach = given.reach_rel * compute_diagonal(surface);
    FeaturedSurface featured;
    if (!given.lines.empty()) {
        auto inserted = insert_features(surface, given.lines, reach, context);
        if (!inserted) return inserted.error();
        featured = std::move(*inserted);
    }
    Result<CleanSurface> clean = clean_surface(given.lines.empty() ? surface : featured.soup);
    if (!clean) return clean.error();
    const std::vector<std::array<Index, 2>> on_surface = merge_edges(featured.soup.vertices, featured.edges);
    FeatureLimits limits = feature_limits(options);
    limits.given = on_surface;
    const FeatureGraph graph = compute_feature_graph(clean->vertices, clean->polygons, limits);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    BoundaryModelParts parts;
    parts.vertices = std::move(clean->vertices);
    parts.triangles = std::move(clean->triangles);
    parts.source.resize(parts.triangles.size());
    std::iota(parts.source.begin(), parts.source.end(), SourceFace{0});
    add_features(graph, parts);
    parts.source = std::move(clean->source);
    BoundaryModel model = BoundaryModelBuilder::assemble(std::move(parts));

    const SurfacePolygons polygons = compute_boundary_polygons(mesh, topology);
    auto followed = follow(given.lines, mesh, polygons, reach, options.reach, context);
    if (!followed) return followed.error();
    limits.given = followed->edges;
    const FeatureGraph mesh_graph = compute_feature_graph(mesh.positions, polygons, limits);
    SurfaceAssociation bound = associate(mesh, topology, mesh_graph, model, options.reach, context);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    bound.report.dropped_triangles = clean->dropped_triangles;
    bound.report.open_edges = clean->open_edges;
    bound.report.nonmanifold_edges = clean->nonmanifold_edges;
    for (const FollowedLines::Gap& gap : followed->gaps)
        bound.report.unmatched_lines.push_back(place_of(gap));
    BoundaryModelBuilder::bind(model, std::move(bound.association), std::move(bound.feature_edges),
                               std::move(bound.report), kQuadTolerance_rel * model.diagonal());
    return model;
}

} // namespace hexopt
