#include "stages/buffer/sheet_mesh.hpp"

#include "mesh/hanging.hpp"

#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr const char* kStage = "buffer";

struct NamedQuad {
    Quad key;
    Index patch;
    auto operator<=>(const NamedQuad&) const = default;
};

Error bad_input(std::string where, std::string reason) {
    return make_error(ErrorCode::bad_input, kStage, std::move(where), std::move(reason));
}

Status check_fitted(const FittedMesh& fitted) {
    const std::size_t count = fitted.mesh.vertex_count();
    if (fitted.association.size() != count)
        return bad_input("",
                         fmt::format("{} associations for {} vertices", fitted.association.size(), count));
    for (const FittedMesh::RidgeEdge& ridge : fitted.ridges)
        if (ridge.a >= ridge.b || ridge.b >= count)
            return bad_input(fmt::format("ridge edge {} {}", ridge.a, ridge.b), "no edge of two vertices");
    if (!std::is_sorted(fitted.ridges.begin(), fitted.ridges.end()))
        return bad_input("", "ridge edges are not sorted");
    return Done{};
}

std::vector<SurfaceQuad> find_surface(const HexMesh& mesh, const Topology& topology) {
    std::vector<NamedQuad> named;
    named.reserve(mesh.boundary.size());
    for (const BoundaryQuad& quad : mesh.boundary) named.push_back({sorted_quad(quad.vertices), quad.patch});
    std::sort(named.begin(), named.end());
    std::vector<SurfaceQuad> surface;
    surface.reserve(topology.boundary_faces.size());
    for (CellFace face : topology.boundary_faces) {
        const Quad key = sorted_quad(face_vertices(mesh, face));
        const auto at = std::lower_bound(named.begin(), named.end(), NamedQuad{key, 0});
        surface.push_back({face, at != named.end() && at->key == key ? at->patch : kNoIndex});
    }
    return surface;
}

Hanging rows_of(const SplitTables& splits) {
    Hanging rows;
    constexpr std::array<double, 2> kHalves = {0.5, 0.5};
    constexpr std::array<double, 4> kQuarters = {0.25, 0.25, 0.25, 0.25};
    for (const SplitTables::Middle& entry : splits.middles)
        append_row(rows, entry.vertex, std::array{low_of(entry.edge), high_of(entry.edge)}, kHalves);
    for (const SplitTables::Centre& entry : splits.centres)
        append_row(rows, entry.vertex, entry.corners, kQuarters);
    return rows;
}

/// Hanging vertices get that kind; what no longer hangs is bound to the curve or patch there and put on it.
void settle_hanging(SheetMesh& mesh, const Hanging& hanging, const BoundaryModel& model) {
    std::vector<Association>& association = mesh.association;
    for (Index v : hanging.vertex) association[v] = {EntityKind::hanging, kNoIndex};
    const std::vector<Index> row = compute_hanging_row(hanging, association.size());
    std::vector<Index> freed;
    for (Index v = 0; v < association.size(); ++v)
        if (association[v].kind == EntityKind::hanging && (row.empty() || row[v] == kNoIndex)) {
            association[v] = {};
            freed.push_back(v);
        }
    if (freed.empty()) return;
    const auto is_freed = [&](Index v) { return std::binary_search(freed.begin(), freed.end(), v); };
    for (const SurfaceQuad& quad : mesh.surface)
        for (Index v : mesh.vertices_of(quad.face))
            if (quad.patch != kNoIndex && is_freed(v)) association[v] = {EntityKind::patch, quad.patch};
    for (const FittedMesh::RidgeEdge& ridge : mesh.ridges)
        for (Index v : {ridge.a, ridge.b})
            if (is_freed(v)) association[v] = {EntityKind::curve, ridge.curve};
    for (Index v : freed) mesh.positions[v] = model.project(association[v], mesh.positions[v]).point;
}

} // namespace

Index SheetMesh::curve_of(Index a, Index b) const {
    const FittedMesh::RidgeEdge key{std::min(a, b), std::max(a, b), 0};
    const auto at = std::lower_bound(ridges.begin(), ridges.end(), key);
    return at != ridges.end() && at->a == key.a && at->b == key.b ? at->curve : kNoIndex;
}

SheetMeshOrigin origin_of(const HexMesh& mesh) {
    return {mesh.patch_names, mesh.revision, !mesh.level.empty()};
}

Result<SheetMesh> open_sheet_mesh(FittedMesh fitted, const Parallel& parallel) {
    if (Status ok = check_fitted(fitted); !ok) return ok.error();
    SheetMesh mesh;
    mesh.surface = find_surface(fitted.mesh, compute_topology(fitted.mesh, parallel));
    mesh.splits = find_splits(fitted.mesh);
    mesh.positions = std::move(fitted.mesh.positions);
    mesh.unfitted = std::move(fitted.unfitted);
    mesh.cells = std::move(fitted.mesh.cells);
    mesh.level = std::move(fitted.mesh.level);
    mesh.level.resize(mesh.cells.size());
    mesh.association = std::move(fitted.association);
    mesh.ridges = std::move(fitted.ridges);
    return mesh;
}

Result<FittedMesh> close_sheet_mesh(SheetMesh mesh, SheetMeshOrigin origin, const BoundaryModel& model,
                                    const Parallel& parallel) {
    mesh.positions.shrink_to_fit();
    mesh.unfitted.shrink_to_fit();
    mesh.cells.shrink_to_fit();
    mesh.level.shrink_to_fit();
    mesh.association.shrink_to_fit();
    Result<Hanging> hanging = close_hanging(rows_of(mesh.splits), mesh.positions.size());
    if (!hanging) return hanging.error();
    settle_hanging(mesh, *hanging, model);
    FittedMesh fitted;
    fitted.mesh.boundary.reserve(mesh.surface.size());
    for (const SurfaceQuad& quad : mesh.surface)
        fitted.mesh.boundary.push_back({mesh.vertices_of(quad.face), quad.patch});
    fitted.mesh.positions = std::move(mesh.positions);
    fitted.mesh.cells = std::move(mesh.cells);
    if (origin.has_level) fitted.mesh.level = std::move(mesh.level);
    fitted.mesh.hanging = std::move(hanging).value();
    fitted.mesh.patch_names = std::move(origin.patch_names);
    fitted.mesh.revision = origin.revision + 1;
    fitted.association = std::move(mesh.association);
    fitted.ridges = std::move(mesh.ridges);
    apply_hanging(fitted.mesh, parallel);
    fitted.unfitted = std::move(mesh.unfitted);
    if (!fitted.unfitted.empty()) apply_hanging(fitted.mesh.hanging, fitted.unfitted, parallel);
    return fitted;
}

} // namespace hexopt
