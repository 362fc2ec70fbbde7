#include "pipeline/surface_quads.hpp"

#include <algorithm>

namespace hexopt {

namespace {

constexpr double kOff_rel = 1e-7; ///< of the diagonal: farther from what it is bound to a vertex was let off

} // namespace

SurfaceQuads::SurfaceQuads(const HexMesh& mesh, const Topology& topology, const BoundaryModel& model)
    : mesh_(mesh), topology_(topology), model_(model), ridge_(mesh.vertex_count()) {
    std::vector<std::vector<Index>> at(mesh.vertex_count());
    for (const CellFace& face : topology.boundary_faces) {
        for (Index v : face_vertices(mesh, face)) at[v].push_back(static_cast<Index>(quads_.size()));
        quads_.push_back(face_vertices(mesh, face));
    }
    for (const std::vector<Index>& quads : at) {
        vertex_quad_.item.insert(vertex_quad_.item.end(), quads.begin(), quads.end());
        vertex_quad_.offset.push_back(vertex_quad_.item.size());
    }
    for (const auto& [a, b] : model.feature_edges()) {
        ridge_[a].push_back(b);
        ridge_[b].push_back(a);
    }
    hint_.assign(quads_.size(), kNoIndex);
}

std::array<Point, 4> SurfaceQuads::corners(Index q) const {
    std::array<Point, 4> x;
    for (int k = 0; k < 4; ++k) x[k] = mesh_.positions[quads_[q][k]];
    return x;
}

double SurfaceQuads::distance(Index q, const Point& place) {
    const Projection nearest = model_.project_patch(kNoIndex, place, hint_[q]);
    hint_[q] = nearest.element;
    return nearest.distance;
}

double SurfaceQuads::vertex_distance(Index v) const {
    return model_.distance(mesh_.positions[v],
                           vertex_quad_[v].empty() ? kNoIndex : hint_[vertex_quad_[v].front()]);
}

double SurfaceQuads::distance(Index q) { return model_.quad_deviation(corners(q), kNoIndex, hint_[q]); }

double SurfaceQuads::edge_distance(Index a, Index b) const {
    const auto bound = model_.associations();
    const Association& on = bound[a].kind == EntityKind::curve ? bound[a] : bound[b];
    if (on.kind != EntityKind::curve) return 0;
    double largest = 0;
    Index hint = kNoIndex;
    for (double t : {0.25, 0.5, 0.75}) {
        const Projection at = model_.project(on, (1 - t) * mesh_.positions[a] + t * mesh_.positions[b], hint);
        hint = at.element;
        largest = std::max(largest, at.distance);
    }
    return largest;
}

std::optional<Projection> SurfaceQuads::find_place(Index v) const {
    const Association on = model_.associations()[v];
    const bool hangs = !topology_.hanging_row.empty() && topology_.hanging_row[v] != kNoIndex;
    if (hangs || (on.kind != EntityKind::patch && on.kind != EntityKind::curve)) return {};
    const Projection at = model_.project(on, mesh_.positions[v]);
    if (at.distance > kOff_rel * model_.diagonal()) return {};
    return at;
}

} // namespace hexopt
