#include "domain/associate.hpp"

#include "domain/boundary_model_builder.hpp"
#include "domain/point_tree.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <tuple>

namespace hexopt {

namespace {

// A vertex without a feature in the mesh is bound to a corner or curve that it lies on to within this
// fraction of its local edge length.
constexpr double kCoincident = 0.01;
// A vertex goes with its neighbours' patch or curve where that is farther than the nearest one by at most
// this fraction of its local edge length.
constexpr double kSlack = 0.25;
constexpr std::size_t kListedFar = 20;
constexpr std::size_t kChunk = 64;

class Associator {
  public:
    Associator(const HexMesh& mesh, const Topology& topology, const FeatureGraph& graph,
               const BoundaryModel& model, double reach, const Context& context)
        : mesh_(mesh), graph_(graph), model_(model), reach_(reach), context_(context) {
        bound_.resize(mesh.vertex_count());
        quads_ = boundary_quads(mesh, topology);
        for (Index v = 0; v < bound_.size(); ++v) {
            if (!topology.hanging_row.empty() && topology.hanging_row[v] != kNoIndex)
                bound_[v] = {EntityKind::hanging, kNoIndex};
            else if (topology.on_boundary[v])
                open_.push_back(v);
        }
        compute_local_edges();
    }

    SurfaceAssociation run() {
        bind_corners();
        bind_curves();
        bind_patches();
        SurfaceAssociation result;
        result.feature_edges = find_feature_edges();
        result.report = report();
        result.association = std::move(bound_);
        return result;
    }

  private:
    bool is_open(Index v) const { return bound_[v].kind == EntityKind::interior && edge_[v] > 0; }
    bool is_feature(Index v) const {
        return graph_.vertex_corner[v] != kNoIndex || graph_.vertex_curve[v] != kNoIndex;
    }

    void compute_local_edges() {
        edge_.assign(mesh_.vertex_count(), 0);
        std::vector<Index> count(mesh_.vertex_count(), 0);
        for (const Quad& q : quads_)
            for (int k = 0; k < 4; ++k) {
                const Index a = q[k], b = q[(k + 1) % 4];
                const double length = glm::length(mesh_.positions[a] - mesh_.positions[b]);
                for (Index v : {a, b}) edge_[v] += length, ++count[v];
            }
        for (Index v = 0; v < edge_.size(); ++v)
            if (count[v] > 0) edge_[v] /= count[v];
    }

    /// How far vertex v may be from a corner: exact features of the mesh reach farther than chance meetings.
    double corner_reach(Index v) const { return (is_feature(v) ? reach_ : kCoincident) * edge_[v]; }

    /// Pairs of corner and vertex, nearest first and mesh corners before others; each is used once.
    void bind_corners() {
        struct Pair {
            bool plain; ///< not a corner of the mesh
            double distance;
            Index corner, vertex;
        };
        std::vector<Pair> pairs;
        if (model_.corner_count() == 0) return;
        const PointTree vertices(mesh_.positions, open_);
        double farthest = 0;
        for (Index v : open_) farthest = std::max(farthest, corner_reach(v));
        for (Index c = 0; c < model_.corner_count(); ++c)
            vertices.visit_within(model_.corner_point(c), farthest, [&](Index v) {
                const double distance = glm::length(mesh_.positions[v] - model_.corner_point(c));
                if (distance <= corner_reach(v))
                    pairs.push_back({graph_.vertex_corner[v] == kNoIndex, distance, c, v});
            });
        std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
            return std::tie(a.plain, a.distance, a.corner, a.vertex) <
                   std::tie(b.plain, b.distance, b.corner, b.vertex);
        });
        std::vector<std::uint8_t> taken(model_.corner_count(), 0);
        for (const Pair& p : pairs) {
            if (taken[p.corner] || !is_open(p.vertex)) continue;
            taken[p.corner] = 1;
            bound_[p.vertex] = {EntityKind::corner, p.corner};
        }
    }

    struct Candidate {
        Index entity = kNoIndex;
        double distance = 0;
    };

    /// For each group of vertices: the entity that most of its candidates name, the lower one of equals.
    static std::vector<Index> find_majorities(const std::vector<Index>& group_of, Index group_count,
                                              const std::vector<Candidate>& candidates) {
        std::map<std::pair<Index, Index>, std::size_t> votes;
        for (std::size_t i = 0; i < group_of.size(); ++i)
            if (group_of[i] != kNoIndex && candidates[i].entity != kNoIndex)
                ++votes[{group_of[i], candidates[i].entity}];
        std::vector<Index> majority(group_count, kNoIndex);
        std::vector<std::size_t> most(group_count, 0);
        for (const auto& [key, count] : votes)
            if (count > most[key.first]) most[key.first] = count, majority[key.first] = key.second;
        return majority;
    }

    /// Nearest entity of each open vertex for which `allowed` says yes; the majority of its group (chain or
    /// patch of the mesh) where that is hardly farther.
    template <class Group, class Project, class Reach>
    void bind_nearest(EntityKind kind, Index group_count, const Group& group, const Project& project,
                      const Reach& reach) {
        std::vector<Index> vertices, group_of;
        for (Index v : open_)
            if (is_open(v)) vertices.push_back(v), group_of.push_back(group(v));
        std::vector<Candidate> nearest(vertices.size());
        context_.parallel().for_each(vertices.size(), kChunk, [&](std::size_t i) {
            const Candidate found = project(kNoIndex, mesh_.positions[vertices[i]]);
            if (found.distance <= reach(vertices[i])) nearest[i] = found;
        });
        const std::vector<Index> majority = find_majorities(group_of, group_count, nearest);
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            if (nearest[i].entity == kNoIndex) continue;
            Index entity = nearest[i].entity;
            const Index usual = group_of[i] == kNoIndex ? kNoIndex : majority[group_of[i]];
            const Index v = vertices[i];
            if (usual != kNoIndex && usual != entity &&
                project(usual, mesh_.positions[v]).distance <= nearest[i].distance + kSlack * edge_[v])
                entity = usual;
            bound_[v] = {kind, entity};
        }
    }

    void bind_curves() {
        if (model_.curve_count() == 0) return;
        bind_nearest(
            EntityKind::curve, static_cast<Index>(graph_.curve_vertex.rows()),
            [&](Index v) { return graph_.vertex_curve[v]; },
            [&](Index curve, const Point& p) {
                const Projection on = model_.project_curve(curve, p);
                return Candidate{curve == kNoIndex ? model_.curve_of_segment(on.element) : curve,
                                 on.distance};
            },
            [&](Index v) { return corner_reach(v); });
    }

    void bind_patches() {
        bind_nearest(
            EntityKind::patch, graph_.patch_count,
            [&](Index v) { return is_feature(v) ? kNoIndex : graph_.vertex_patch[v]; },
            [&](Index patch, const Point& p) {
                const Projection on = model_.project_patch(patch, p);
                return Candidate{patch == kNoIndex ? model_.patch_of_triangle(on.element) : patch,
                                 on.distance};
            },
            [&](Index) { return std::numeric_limits<double>::infinity(); });
    }

    double distance_of_middle(Index curve, Index a, Index b) const {
        return model_.project_curve(curve, 0.5 * (mesh_.positions[a] + mesh_.positions[b])).distance;
    }

    /// The curve along which an edge of the boundary runs, judged by the bindings of its ends.
    Index curve_of_edge(Index a, Index b) const {
        Association s = carried_[a], t = carried_[b];
        if (s.kind == EntityKind::corner) std::swap(s, t);
        if (s.kind == EntityKind::curve) {
            if (t == s) return s.entity;
            const std::array<Index, 2> ends = model_.curve_ends(s.entity);
            const bool at_end = t.kind == EntityKind::corner && (t.entity == ends[0] || t.entity == ends[1]);
            return at_end ? s.entity : kNoIndex;
        }
        if (s.kind != EntityKind::corner || t.kind != EntityKind::corner) return kNoIndex;
        const auto [first, last] = curve_between_.equal_range(std::minmax(s.entity, t.entity));
        const auto nearest = std::min_element(first, last, [&](const auto& x, const auto& y) {
            return distance_of_middle(x.second, a, b) < distance_of_middle(y.second, a, b);
        });
        return nearest == last ? kNoIndex : nearest->second;
    }

    /// A hanging vertex goes along the curve that its masters lie on together.
    void carry_hanging() {
        carried_ = bound_;
        for (std::size_t row = 0; row < mesh_.hanging.count(); ++row) {
            const std::size_t begin = mesh_.hanging.offset[row], end = mesh_.hanging.offset[row + 1];
            const Index first = mesh_.hanging.master[begin];
            Index curve = begin + 1 < end ? curve_of_edge(first, mesh_.hanging.master[begin + 1]) : kNoIndex;
            for (std::size_t k = begin + 2; k < end && curve != kNoIndex; ++k)
                if (curve_of_edge(first, mesh_.hanging.master[k]) != curve) curve = kNoIndex;
            if (curve != kNoIndex) carried_[mesh_.hanging.vertex[row]] = {EntityKind::curve, curve};
        }
    }

    std::vector<std::array<Index, 2>> find_feature_edges() {
        for (Index c = 0; c < model_.curve_count(); ++c)
            curve_between_.emplace(std::minmax({model_.curve_ends(c)[0], model_.curve_ends(c)[1]}), c);
        carry_hanging();
        std::vector<std::array<Index, 2>> edges;
        followed_.assign(model_.curve_count(), 0);
        for (const Quad& q : quads_)
            for (int k = 0; k < 4; ++k) {
                const auto [low, high] = std::minmax(q[k], q[(k + 1) % 4]);
                const Index curve = curve_of_edge(low, high);
                if (curve == kNoIndex || !runs_along(curve, low, high)) continue;
                followed_[curve] = 1;
                edges.push_back({low, high});
            }
        std::sort(edges.begin(), edges.end());
        edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
        return edges;
    }

    /// An edge may have both ends on a curve and yet cut across a bend.
    bool runs_along(Index curve, Index a, Index b) const {
        return distance_of_middle(curve, a, b) <=
               reach_ * glm::length(mesh_.positions[b] - mesh_.positions[a]);
    }

    AssociationReport report() const {
        AssociationReport result;
        std::vector<std::uint8_t> corner_used(model_.corner_count(), 0);
        for (Index v : open_) {
            const Association a = bound_[v];
            if (a.kind == EntityKind::corner) corner_used[a.entity] = 1;
            if (a.kind == EntityKind::patch && is_feature(v)) ++result.unmatched_vertices;
            const double distance = model_.project(a, mesh_.positions[v]).distance;
            result.largest_distance = std::max(result.largest_distance, distance);
            if (distance > reach_ * edge_[v]) result.far_vertices.push_back({v, distance});
        }
        result.far_count = result.far_vertices.size();
        std::sort(result.far_vertices.begin(), result.far_vertices.end(), [](const auto& a, const auto& b) {
            return a.distance != b.distance ? a.distance > b.distance : a.vertex < b.vertex;
        });
        if (result.far_count > kListedFar) result.far_vertices.resize(kListedFar);
        result.unmatched_corners =
            static_cast<std::size_t>(std::count(corner_used.begin(), corner_used.end(), 0));
        result.unmatched_curves = static_cast<std::size_t>(std::count(followed_.begin(), followed_.end(), 0));
        return result;
    }

    const HexMesh& mesh_;
    const FeatureGraph& graph_;
    const BoundaryModel& model_;
    const double reach_;
    const Context& context_;
    std::vector<Quad> quads_;
    std::vector<Index> open_;  ///< boundary vertices that do not hang
    std::vector<double> edge_; ///< per vertex: mean length of boundary edges
    std::vector<Association> bound_;
    std::vector<Association> carried_; ///< bound_ with the hanging vertices on curves
    std::multimap<std::pair<Index, Index>, Index> curve_between_; ///< pair of corners -> curve
    std::vector<std::uint8_t> followed_;                          ///< per curve: a mesh edge runs along it
};

} // namespace

SurfaceAssociation associate(const HexMesh& mesh, const Topology& topology, const FeatureGraph& graph,
                             const BoundaryModel& model, double reach, const Context& context) {
    return Associator(mesh, topology, graph, model, reach, context).run();
}

} // namespace hexopt
