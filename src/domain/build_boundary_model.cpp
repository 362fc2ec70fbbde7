#include "domain/boundary_model_builder.hpp"
#include "domain/boundary_polygons.hpp"

#include <cmath>
#include <fmt/format.h>

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

void add_quad_fans(std::span<const Quad> quads, BoundaryModelParts& parts) {
    parts.triangles.reserve(4 * quads.size());
    for (Index q = 0; q < quads.size(); ++q) {
        const Quad& quad = quads[q];
        const auto centre = static_cast<Index>(parts.vertices.size());
        const auto x = [&](int k) { return parts.vertices[quad[k]]; };
        parts.vertices.push_back(quad_centre({x(0), x(1), x(2), x(3)}));
        for (int k = 0; k < 4; ++k) {
            parts.triangles.push_back({quad[k], quad[(k + 1) % 4], centre});
            parts.source.push_back(q);
        }
    }
}

namespace {

/// Each fan belongs to its quad's patch and faces the way of the patch's first quad.
void assign_patches(const FeatureGraph& graph, BoundaryModelParts& parts) {
    for (std::size_t t = 0; t < parts.triangles.size(); ++t) {
        parts.patch.push_back(graph.face_patch[parts.source[t]]);
        if (graph.flipped[parts.source[t]]) std::swap(parts.triangles[t][0], parts.triangles[t][1]);
    }
    parts.patch_count = graph.patch_count;
}

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

} // namespace

void add_features(const FeatureGraph& graph, BoundaryModelParts& parts) {
    parts.curve_vertex = graph.curve_vertex;
    parts.corner_vertex = graph.corner_vertex;
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::span<const Index> chain = graph.curve_vertex[c];
        parts.smooth.push_back(chain.front() == chain.back() &&
                               graph.vertex_corner[chain.front()] == kNoIndex);
    }
}

Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const BoundaryOptions& options, Context& context) {
    if (Status ok = check_boundary(mesh, topology); !ok) return ok.error();
    const SurfacePolygons polygons = compute_boundary_polygons(mesh, topology);
    const FeatureGraph graph =
        compute_feature_graph(mesh.positions, polygons,
                              {options.feature_angle_deg, options.corner_turn_deg, options.patch_borders});
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    BoundaryModelParts parts;
    parts.vertices = mesh.positions;
    add_quad_fans(boundary_quads(mesh, topology), parts);
    assign_patches(graph, parts);
    add_features(graph, parts);
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::span<const Index> chain = graph.curve_vertex[c];
        for (std::size_t i = 0; i + 1 < chain.size(); ++i)
            parts.feature_edges.push_back({chain[i], chain[i + 1]});
    }
    parts.association = associate_own(topology, graph);
    return BoundaryModelBuilder::assemble(std::move(parts));
}

} // namespace hexopt
