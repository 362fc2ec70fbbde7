#include "domain/feature_graph.hpp"

#include "core/union_find.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

namespace hexopt {

namespace {

/// One side of an edge: slot `at_low` (of SurfacePolygons::vertex.item) holds the smaller vertex.
struct EdgeSide {
    Index low, high;
    Index face;
    Index slot_low, slot_high;
    bool forward; ///< the face runs from low to high
};

struct FeatureEdge {
    Index low, high;
    bool only_given; ///< a feature for no other reason
};

std::vector<EdgeSide> collect_edge_sides(const SurfacePolygons& polygons) {
    std::vector<EdgeSide> sides;
    sides.reserve(polygons.vertex.item.size());
    for (std::size_t f = 0; f < polygons.vertex.rows(); ++f) {
        const std::size_t begin = polygons.vertex.offset[f], end = polygons.vertex.offset[f + 1];
        for (std::size_t s = begin; s < end; ++s) {
            const std::size_t next = s + 1 == end ? begin : s + 1;
            const Index a = polygons.vertex.item[s], b = polygons.vertex.item[next];
            if (a == b) continue;
            const auto sa = static_cast<Index>(s), sb = static_cast<Index>(next);
            const auto face = static_cast<Index>(f);
            sides.push_back(a < b ? EdgeSide{a, b, face, sa, sb, true} : EdgeSide{b, a, face, sb, sa, false});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
        if (a.low != b.low) return a.low < b.low;
        if (a.high != b.high) return a.high < b.high;
        return a.slot_low < b.slot_low;
    });
    return sides;
}

/// Calls body(span of sides) for every edge.
template <class Body>
void for_each_edge(const std::vector<EdgeSide>& sides, const Body& body) {
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high)
            ++end;
        body(std::span<const EdgeSide>(sides).subspan(i, end - i));
        i = end;
    }
}

bool is_feature(std::span<const EdgeSide> edge, const SurfacePolygons& polygons,
                const FeatureLimits& limits) {
    if (edge.size() != 2) return true;
    const Index a = edge[0].face, b = edge[1].face;
    if (limits.patch_borders && polygons.patch[a] != polygons.patch[b]) return true;
    const Point na = polygons.normal[a];
    const Point nb = edge[0].forward == edge[1].forward ? -polygons.normal[b] : polygons.normal[b];
    // A polygon without area has no normal to compare.
    if (na == Point(0) || nb == Point(0)) return false;
    const double angle = std::atan2(glm::length(glm::cross(na, nb)), glm::dot(na, nb));
    return angle > limits.feature_angle_deg * std::numbers::pi / 180;
}

struct Skeleton {
    std::vector<FeatureEdge> edges;
    Csr<Index> vertex_edge;                    ///< per vertex: its feature edges
    std::vector<std::uint8_t> touches_itself;  ///< per vertex: several fans of faces meet there
    std::vector<std::array<Index, 2>> smooth;  ///< pairs of faces over edges that are not features
    std::vector<std::uint8_t> smooth_opposite; ///< per pair: 1 where the orientations differ
};

Csr<Index> compute_vertex_edges(std::size_t vertex_count, const std::vector<FeatureEdge>& edges) {
    Csr<Index> csr;
    csr.offset.assign(vertex_count + 1, 0);
    for (const FeatureEdge& e : edges) ++csr.offset[e.low + 1], ++csr.offset[e.high + 1];
    std::partial_sum(csr.offset.begin(), csr.offset.end(), csr.offset.begin());
    csr.item.resize(csr.offset.back());
    std::vector<std::size_t> next(csr.offset.begin(), csr.offset.end() - 1);
    for (Index e = 0; e < edges.size(); ++e) {
        csr.item[next[edges[e].low]++] = e;
        csr.item[next[edges[e].high]++] = e;
    }
    return csr;
}

Skeleton compute_skeleton(std::size_t vertex_count, const SurfacePolygons& polygons,
                          const FeatureLimits& limits) {
    Skeleton skeleton;
    const std::vector<EdgeSide> sides = collect_edge_sides(polygons);
    UnionFind fans(polygons.vertex.item.size());
    for_each_edge(sides, [&](std::span<const EdgeSide> edge) {
        for (std::size_t i = 1; i < edge.size(); ++i) {
            fans.join(edge[0].slot_low, edge[i].slot_low);
            fans.join(edge[0].slot_high, edge[i].slot_high);
        }
        const bool by_shape = is_feature(edge, polygons, limits);
        if (by_shape || std::binary_search(limits.given.begin(), limits.given.end(),
                                           std::array{edge[0].low, edge[0].high})) {
            skeleton.edges.push_back({edge[0].low, edge[0].high, !by_shape});
        } else {
            skeleton.smooth.push_back({edge[0].face, edge[1].face});
            skeleton.smooth_opposite.push_back(edge[0].forward == edge[1].forward);
        }
    });
    skeleton.vertex_edge = compute_vertex_edges(vertex_count, skeleton.edges);
    skeleton.touches_itself.assign(vertex_count, 0);
    std::vector<Index> fan(vertex_count, kNoIndex);
    for (Index s = 0; s < polygons.vertex.item.size(); ++s) {
        const Index v = polygons.vertex.item[s], root = fans.find(s);
        if (fan[v] == kNoIndex) fan[v] = root;
        if (fan[v] != root) skeleton.touches_itself[v] = 1;
    }
    return skeleton;
}

/// Connected faces get one number; faces that oppose the first one of their patch are marked.
void number_patches(const Skeleton& skeleton, std::size_t face_count, FeatureGraph& graph) {
    Csr<std::array<Index, 2>> neighbour; // {face, pair}
    neighbour.offset.assign(face_count + 1, 0);
    for (const auto& pair : skeleton.smooth) ++neighbour.offset[pair[0] + 1], ++neighbour.offset[pair[1] + 1];
    std::partial_sum(neighbour.offset.begin(), neighbour.offset.end(), neighbour.offset.begin());
    neighbour.item.resize(neighbour.offset.back());
    std::vector<std::size_t> next(neighbour.offset.begin(), neighbour.offset.end() - 1);
    for (Index k = 0; k < skeleton.smooth.size(); ++k) {
        const auto [a, b] = skeleton.smooth[k];
        neighbour.item[next[a]++] = {b, k};
        neighbour.item[next[b]++] = {a, k};
    }
    graph.face_patch.assign(face_count, kNoIndex);
    graph.flipped.assign(face_count, 0);
    std::vector<Index> queue;
    for (Index seed = 0; seed < face_count; ++seed) {
        if (graph.face_patch[seed] != kNoIndex) continue;
        queue.assign(1, seed);
        graph.face_patch[seed] = graph.patch_count;
        for (std::size_t head = 0; head < queue.size(); ++head)
            for (const auto& [face, pair] : neighbour[queue[head]]) {
                if (graph.face_patch[face] != kNoIndex) continue;
                graph.face_patch[face] = graph.patch_count;
                graph.flipped[face] = graph.flipped[queue[head]] ^ skeleton.smooth_opposite[pair];
                queue.push_back(face);
            }
        ++graph.patch_count;
    }
}

Index other_end(const FeatureEdge& edge, Index v) { return edge.low == v ? edge.high : edge.low; }

/// Whether a feature by shape ends where one that is given goes on: its end stays a corner.
bool changes_kind(Index v, const Skeleton& skeleton) {
    const std::span<const Index> edges = skeleton.vertex_edge[v];
    return skeleton.edges[edges[0]].only_given != skeleton.edges[edges[1]].only_given;
}

bool turns_sharply(Index v, std::span<const Point> positions, const Skeleton& skeleton, double limit_deg) {
    const std::span<const Index> edges = skeleton.vertex_edge[v];
    const Point in = positions[v] - positions[other_end(skeleton.edges[edges[0]], v)];
    const Point out = positions[other_end(skeleton.edges[edges[1]], v)] - positions[v];
    return std::atan2(glm::length(glm::cross(in, out)), glm::dot(in, out)) >
           limit_deg * std::numbers::pi / 180;
}

void find_corners(std::span<const Point> positions, const Skeleton& skeleton, double turn_deg,
                  FeatureGraph& graph) {
    graph.vertex_corner.assign(positions.size(), kNoIndex);
    for (Index v = 0; v < positions.size(); ++v) {
        const std::size_t degree = skeleton.vertex_edge[v].size();
        const bool corner =
            skeleton.touches_itself[v] || (degree != 0 && degree != 2) ||
            (degree == 2 && (changes_kind(v, skeleton) || turns_sharply(v, positions, skeleton, turn_deg)));
        if (!corner) continue;
        graph.vertex_corner[v] = static_cast<Index>(graph.corner_vertex.size());
        graph.corner_vertex.push_back(v);
    }
}

/// Follows feature edges from `start` over `edge` to the next corner or back to the start.
void trace_curve(Index start, Index edge, const Skeleton& skeleton, std::vector<std::uint8_t>& used,
                 FeatureGraph& graph) {
    const auto curve = static_cast<Index>(graph.closed.size());
    Index at = start;
    graph.curve_vertex.item.push_back(at);
    while (true) {
        used[edge] = 1;
        at = other_end(skeleton.edges[edge], at);
        graph.curve_vertex.item.push_back(at);
        if (graph.vertex_corner[at] != kNoIndex) break;
        graph.vertex_curve[at] = curve;
        if (at == start) break;
        const std::span<const Index> both = skeleton.vertex_edge[at];
        edge = both[0] == edge ? both[1] : both[0];
    }
    graph.curve_vertex.offset.push_back(graph.curve_vertex.item.size());
    graph.closed.push_back(at == start);
}

void trace_curves(const Skeleton& skeleton, FeatureGraph& graph) {
    const std::size_t vertex_count = graph.vertex_corner.size();
    graph.vertex_curve.assign(vertex_count, kNoIndex);
    std::vector<std::uint8_t> used(skeleton.edges.size(), 0);
    for (bool from_corners : {true, false})
        for (Index v = 0; v < vertex_count; ++v) {
            if ((graph.vertex_corner[v] != kNoIndex) != from_corners) continue;
            for (Index e : skeleton.vertex_edge[v])
                if (!used[e]) trace_curve(v, e, skeleton, used, graph);
        }
}

} // namespace

FeatureGraph compute_feature_graph(std::span<const Point> positions, const SurfacePolygons& polygons,
                                   const FeatureLimits& limits) {
    FeatureGraph graph;
    const Skeleton skeleton = compute_skeleton(positions.size(), polygons, limits);
    number_patches(skeleton, polygons.vertex.rows(), graph);
    find_corners(positions, skeleton, limits.corner_turn_deg, graph);
    trace_curves(skeleton, graph);
    graph.vertex_patch.assign(positions.size(), kNoIndex);
    for (std::size_t f = 0; f < polygons.vertex.rows(); ++f)
        for (Index v : polygons.vertex[f]) graph.vertex_patch[v] = graph.face_patch[f];
    return graph;
}

} // namespace hexopt
