#include "stages/buffer/buffer_counts.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

bool is_ridge_turn(const SheetMesh& mesh, const Quad& q, int corner, std::array<Index, 2>& curves) {
    curves = {mesh.curve_of(q[(corner + 3) % 4], q[corner]), mesh.curve_of(q[corner], q[(corner + 1) % 4])};
    return curves[0] != kNoIndex && curves[1] != kNoIndex;
}

double angle_at_deg(const SheetMesh& mesh, const Quad& q, int corner) {
    const Point x = mesh.positions[q[corner]];
    const Point d = mesh.positions[q[(corner + 1) % 4]] - x, e = mesh.positions[q[(corner + 3) % 4]] - x;
    return std::atan2(glm::length(glm::cross(d, e)), glm::dot(d, e)) * 180 / std::numbers::pi;
}

} // namespace

std::vector<Index> find_flat_quads(const SheetMesh& mesh) {
    std::vector<Index> flat;
    for (Index i = 0; i < mesh.surface.size(); ++i) {
        const Quad q = mesh.vertices_of(mesh.surface[i].face);
        for (int k = 0; k < 4; ++k) {
            std::array<Index, 2> curves;
            if (mesh.association[q[k]].kind == EntityKind::corner || !is_ridge_turn(mesh, q, k, curves) ||
                curves[0] != curves[1])
                continue;
            flat.push_back(i);
            break;
        }
    }
    return flat;
}

std::vector<Index> find_two_face_quads(const SheetMesh& mesh) {
    struct Owned {
        Index cell, region, quad;
        auto operator<=>(const Owned&) const = default;
    };
    std::vector<Owned> owned;
    owned.reserve(mesh.surface.size());
    for (Index i = 0; i < mesh.surface.size(); ++i)
        owned.push_back({mesh.surface[i].face.cell, mesh.surface[i].region, i});
    std::sort(owned.begin(), owned.end());
    const auto touch = [&](Index i, Index j) {
        const Quad a = mesh.vertices_of(mesh.surface[i].face), b = mesh.vertices_of(mesh.surface[j].face);
        std::vector<Index> common;
        for (Index v : a)
            if (std::find(b.begin(), b.end(), v) != b.end()) common.push_back(v);
        return common.size() == 2 && mesh.curve_of(common[0], common[1]) == kNoIndex;
    };
    std::vector<Index> found;
    for (std::size_t i = 0; i < owned.size(); ++i)
        for (std::size_t j = i + 1;
             j < owned.size() && owned[j].cell == owned[i].cell && owned[j].region == owned[i].region; ++j)
            if (touch(owned[i].quad, owned[j].quad))
                found.insert(found.end(), {owned[i].quad, owned[j].quad});
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

std::vector<Index> find_sharp_corner_quads(const SheetMesh& mesh, const Domain& domain, double corner_deg,
                                           double join_deg) {
    std::vector<Index> sharp;
    for (Index i = 0; i < mesh.surface.size(); ++i) {
        const Quad q = mesh.vertices_of(mesh.surface[i].face);
        for (int k = 0; k < 4; ++k) {
            std::array<Index, 2> curves;
            if (mesh.association[q[k]].kind != EntityKind::corner || !is_ridge_turn(mesh, q, k, curves))
                continue;
            const bool joined =
                std::max(domain.angle[curves[0]].largest, domain.angle[curves[1]].largest) >= join_deg;
            if (!joined || angle_at_deg(mesh, q, k) >= corner_deg) continue;
            sharp.push_back(i);
            break;
        }
    }
    return sharp;
}

std::vector<std::size_t> count_ridge_cells(const SheetMesh& mesh) {
    std::vector<std::uint8_t> on_ridge(mesh.positions.size(), 0);
    for (const FittedMesh::RidgeEdge& ridge : mesh.ridges) on_ridge[ridge.a] = on_ridge[ridge.b] = 1;
    std::vector<EdgeKey> edges;
    for (const Cell& cell : mesh.cells)
        for (const auto& edge : hex::kEdgeVertex)
            if (on_ridge[cell[edge[0]]] && on_ridge[cell[edge[1]]])
                edges.push_back(edge_key(cell[edge[0]], cell[edge[1]]));
    std::sort(edges.begin(), edges.end());
    std::vector<std::size_t> cells;
    for (const FittedMesh::RidgeEdge& ridge : mesh.ridges) {
        const auto [first, last] = std::equal_range(edges.begin(), edges.end(), edge_key(ridge.a, ridge.b));
        cells.push_back(static_cast<std::size_t>(last - first));
    }
    return cells;
}

BufferCounts count_for_buffers(const SheetMesh& mesh, const Domain& domain) {
    BufferCounts counts;
    counts.cells = mesh.cells.size();
    counts.vertices = mesh.positions.size();
    counts.surface_quads = mesh.surface.size();
    counts.flat_quads = find_flat_quads(mesh).size();
    std::vector<Index> two_face;
    for (Index quad : find_two_face_quads(mesh)) two_face.push_back(mesh.surface[quad].face.cell);
    std::sort(two_face.begin(), two_face.end());
    counts.two_face_cells =
        static_cast<std::size_t>(std::unique(two_face.begin(), two_face.end()) - two_face.begin());

    counts.ridge_cells = {{135}, {225}, {360}};
    const std::vector<std::size_t> cells = count_ridge_cells(mesh);
    for (std::size_t r = 0; r < cells.size(); ++r) {
        const double angle = domain.angle[mesh.ridges[r].curve].largest;
        const std::size_t row = angle < 135 ? 0 : angle < 225 ? 1 : 2;
        ++counts.ridge_cells[row].edges[std::min<std::size_t>(8, cells[r])];
    }
    return counts;
}

} // namespace hexopt
