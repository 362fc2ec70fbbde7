#include "stages/fit/surface_mesh.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt::fit {

namespace {

struct Side {
    Index a, b, quad, corner;
    auto operator<=>(const Side&) const = default;
};

void add_vertices(const HexMesh& mesh, const Topology& topology, SurfaceMesh& surface) {
    surface.local.assign(mesh.vertex_count(), kNoIndex);
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (topology.on_boundary[v]) {
            surface.local[v] = static_cast<Index>(surface.vertex.size());
            surface.vertex.push_back(v);
            surface.hanging.push_back(!topology.hanging_row.empty() && topology.hanging_row[v] != kNoIndex);
        }
    for (CellFace face : topology.boundary_faces) {
        Quad quad = face_vertices(mesh, face);
        for (Index& v : quad) v = surface.local[v];
        surface.quad.push_back(quad);
    }
}

void add_edges(SurfaceMesh& surface) {
    std::vector<Side> sides;
    sides.reserve(4 * surface.quad.size());
    for (Index q = 0; q < surface.quad.size(); ++q)
        for (Index k = 0; k < 4; ++k) {
            const auto [a, b] = std::minmax(surface.quad[q][k], surface.quad[q][(k + 1) % 4]);
            sides.push_back({a, b, q, k});
        }
    std::sort(sides.begin(), sides.end());
    surface.quad_edge.resize(surface.quad.size());
    for (std::size_t i = 0; i < sides.size();) {
        SurfaceMesh::Edge edge{sides[i].a, sides[i].b, {kNoIndex, kNoIndex}, false};
        std::size_t end = i;
        while (end < sides.size() && sides[end].a == edge.a && sides[end].b == edge.b) {
            if (end - i < 2) edge.quad[end - i] = sides[end].quad;
            surface.quad_edge[sides[end].quad][sides[end].corner] = static_cast<Index>(surface.edge.size());
            ++end;
        }
        edge.ridge_allowed = end - i == 2 && !surface.hanging[edge.a] && !surface.hanging[edge.b];
        surface.edge.push_back(edge);
        i = end;
    }
}

template <class Fill>
Csr<Index> make_csr(std::size_t rows, const Fill& for_all) {
    Csr<Index> csr;
    csr.offset.assign(rows + 1, 0);
    for_all([&](Index row, Index) { ++csr.offset[row + 1]; });
    std::partial_sum(csr.offset.begin(), csr.offset.end(), csr.offset.begin());
    csr.item.resize(csr.offset.back());
    std::vector<std::size_t> next(csr.offset.begin(), csr.offset.end() - 1);
    for_all([&](Index row, Index item) { csr.item[next[row]++] = item; });
    return csr;
}

void link_levels(const HexMesh& mesh, SurfaceMesh& surface) {
    const Hanging& hanging = mesh.hanging;
    for (std::size_t r = 0; r < hanging.count(); ++r) {
        if (hanging.offset[r + 1] - hanging.offset[r] != 2) continue;
        const Index middle = surface.local[hanging.vertex[r]];
        const Index a = surface.local[hanging.master[hanging.offset[r]]];
        const Index b = surface.local[hanging.master[hanging.offset[r] + 1]];
        if (middle == kNoIndex || a == kNoIndex || b == kNoIndex) continue;
        const Index coarse = find_edge(surface, a, b);
        if (coarse == kNoIndex || surface.edge[coarse].quad[1] != kNoIndex) continue;
        for (Index end : {a, b})
            if (const Index half = find_edge(surface, end, middle); half != kNoIndex)
                surface.across.push_back({surface.edge[coarse].quad[0], surface.edge[half].quad[0]});
    }
}

} // namespace

Index find_edge(const SurfaceMesh& surface, Index a, Index b) {
    for (Index e : surface.vertex_edge[a])
        if (surface.other_end(e, a) == b) return e;
    return kNoIndex;
}

SurfaceMesh extract_surface(const HexMesh& mesh, const Topology& topology) {
    SurfaceMesh surface;
    add_vertices(mesh, topology, surface);
    add_edges(surface);
    surface.vertex_edge = make_csr(surface.vertex.size(), [&](const auto& add) {
        for (Index e = 0; e < surface.edge.size(); ++e) {
            add(surface.edge[e].a, e);
            add(surface.edge[e].b, e);
        }
    });
    surface.vertex_quad = make_csr(surface.vertex.size(), [&](const auto& add) {
        for (Index q = 0; q < surface.quad.size(); ++q)
            for (Index v : surface.quad[q]) add(v, q);
    });
    surface.size.assign(surface.vertex.size(), 0);
    for (Index v = 0; v < surface.vertex.size(); ++v) {
        for (Index e : surface.vertex_edge[v])
            surface.size[v] += glm::distance(mesh.positions[surface.vertex[surface.edge[e].a]],
                                             mesh.positions[surface.vertex[surface.edge[e].b]]);
        surface.size[v] /= static_cast<double>(surface.vertex_edge[v].size());
    }
    link_levels(mesh, surface);
    return surface;
}

} // namespace hexopt::fit
