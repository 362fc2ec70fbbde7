#include "domain/boundary_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>

namespace hexopt {

namespace {

using Edge = std::array<Index, 2>; // smaller vertex first

Edge edge_of(Index a, Index b) { return a < b ? Edge{a, b} : Edge{b, a}; }

/// Edges that one quad alone uses, and the neighbours over them.
struct OpenEdges {
    std::vector<Edge> edges; ///< sorted
    Csr<Index> neighbour;

    bool contains(Index a, Index b) const {
        return std::binary_search(edges.begin(), edges.end(), edge_of(a, b));
    }
};

OpenEdges find_open_edges(std::span<const Quad> quads, std::size_t vertex_count) {
    std::vector<Edge> all;
    all.reserve(quads.size() * 4);
    for (const Quad& quad : quads)
        for (int k = 0; k < 4; ++k) all.push_back(edge_of(quad[k], quad[(k + 1) % 4]));
    std::sort(all.begin(), all.end());
    OpenEdges open;
    for (std::size_t i = 0; i < all.size();) {
        std::size_t end = i + 1;
        while (end < all.size() && all[end] == all[i]) ++end;
        if (end == i + 1) open.edges.push_back(all[i]);
        i = end;
    }
    open.neighbour.offset.assign(vertex_count + 1, 0);
    for (const Edge& e : open.edges) ++open.neighbour.offset[e[0] + 1], ++open.neighbour.offset[e[1] + 1];
    std::partial_sum(open.neighbour.offset.begin(), open.neighbour.offset.end(),
                     open.neighbour.offset.begin());
    open.neighbour.item.resize(open.neighbour.offset.back());
    std::vector<std::size_t> next(open.neighbour.offset.begin(), open.neighbour.offset.end() - 1);
    for (const Edge& e : open.edges) {
        open.neighbour.item[next[e[0]]++] = e[1];
        open.neighbour.item[next[e[1]]++] = e[0];
    }
    return open;
}

/// Finds the hanging vertices inside an edge: their weights lie between those of its ends.
class EdgeSplitter {
  public:
    EdgeSplitter(const HexMesh& mesh, const Topology& topology, const OpenEdges& open)
        : mesh_(mesh), topology_(topology), open_(open) {}

    /// Vertices strictly inside the edge from a to b in order; empty where it is not split.
    std::vector<Index> split(Index a, Index b) const {
        std::vector<Index> inside;
        if (!open_.contains(a, b)) return inside;
        double reached = 0;
        for (Index at = a; at == a || !open_.contains(at, b);) {
            Index next = kNoIndex;
            double nearest = 1;
            for (Index v : open_.neighbour[at]) {
                const double t = parameter(v, a, b);
                if (t > reached && t < nearest) nearest = t, next = v;
            }
            if (next == kNoIndex) return {};
            inside.push_back(at = next);
            reached = nearest;
        }
        return inside;
    }

  private:
    using Weights = std::map<Index, double>;

    Weights weights(Index v) const {
        const Index row = topology_.hanging_row[v];
        if (row == kNoIndex) return {{v, 1.0}};
        Weights result;
        for (std::size_t k = mesh_.hanging.offset[row]; k < mesh_.hanging.offset[row + 1]; ++k)
            result[mesh_.hanging.master[k]] = mesh_.hanging.weight[k];
        return result;
    }

    /// t with weights(v) = (1 - t) weights(a) + t weights(b), or -1 where there is none.
    double parameter(Index v, Index a, Index b) const {
        if (topology_.hanging_row[v] == kNoIndex) return -1;
        std::map<Index, std::array<double, 3>> rows; // master -> weights in a, b, v
        int column = 0;
        for (Index x : {a, b, v}) {
            for (const auto& [master, weight] : weights(x)) rows[master][column] = weight;
            ++column;
        }
        double along = 0, length2 = 0;
        for (const auto& [master, w] : rows) {
            along += (w[2] - w[0]) * (w[1] - w[0]);
            length2 += (w[1] - w[0]) * (w[1] - w[0]);
        }
        const double t = length2 > 0 ? along / length2 : -1;
        for (const auto& [master, w] : rows)
            if (std::abs(w[0] + t * (w[1] - w[0]) - w[2]) > 1e-9) return -1;
        return t;
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    const OpenEdges& open_;
};

} // namespace

std::vector<Index> find_named_patches(const HexMesh& mesh, std::span<const Quad> quads) {
    auto key = [](Quad quad) {
        std::sort(quad.begin(), quad.end());
        return quad;
    };
    std::vector<std::pair<Quad, Index>> named;
    named.reserve(mesh.boundary.size());
    for (const BoundaryQuad& b : mesh.boundary) named.emplace_back(key(b.vertices), b.patch);
    std::sort(named.begin(), named.end());
    std::vector<Index> patch(quads.size(), kNoIndex);
    for (std::size_t q = 0; q < quads.size(); ++q) {
        const std::pair<Quad, Index> wanted(key(quads[q]), 0);
        const auto found = std::lower_bound(named.begin(), named.end(), wanted);
        if (found != named.end() && found->first == wanted.first) patch[q] = found->second;
    }
    return patch;
}

SurfacePolygons compute_boundary_polygons(const HexMesh& mesh, const Topology& topology) {
    std::vector<Quad> quads;
    quads.reserve(topology.boundary_faces.size());
    for (CellFace face : topology.boundary_faces) quads.push_back(face_vertices(mesh, face));

    SurfacePolygons polygons;
    polygons.patch = find_named_patches(mesh, quads);
    OpenEdges open;
    if (!mesh.hanging.empty()) open = find_open_edges(quads, mesh.vertex_count());
    const EdgeSplitter splitter(mesh, topology, open);
    for (const Quad& quad : quads) {
        for (int k = 0; k < 4; ++k) {
            polygons.vertex.item.push_back(quad[k]);
            if (mesh.hanging.empty()) continue;
            for (Index v : splitter.split(quad[k], quad[(k + 1) % 4])) polygons.vertex.item.push_back(v);
        }
        polygons.vertex.offset.push_back(polygons.vertex.item.size());
        const auto x = [&](int k) { return mesh.positions[quad[k]]; };
        const Point area = glm::cross(x(2) - x(0), x(3) - x(1));
        const double length = glm::length(area);
        polygons.normal.push_back(length > 0 ? area / length : Point(0));
    }
    return polygons;
}

} // namespace hexopt
