#include "stages/fit/capture.hpp"

#include "stages/fit/corner_fans.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <numeric>
#include <queue>
#include <unordered_map>

namespace hexopt::fit {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Candidate {
    double cost;
    Index anchor, vertex;
    auto operator<=>(const Candidate&) const = default;
};

int usable_edges(const SurfaceMesh& surface, Index v) {
    int count = 0;
    for (Index e : surface.vertex_edge[v]) count += surface.edge[e].ridge_allowed;
    return count;
}

/// A mesh ends before the tip of a wedge: where its width is about a cell. The factor by which that is
/// farther than at a right angle, at most kFarthest. angle: through the inside, degrees.
double wedge_factor(double angle_deg) {
    constexpr double kFarthest = 2;
    const double half = 0.5 * angle_deg * std::numbers::pi / 180;
    return std::clamp(0.4 / std::tan(std::max(half, 0.01)) + 0.2, 1.0, kFarthest);
}

/// What it counts in edge lengths where the numbers of quads between an anchor's legs do not suit their
/// angles, and how badly they do where there is no choice of edges.
constexpr double kSectors = 0.3, kNoRing = 0.5;

/// Vertices within reach of each anchor, with what they cost in units of the local edge length: distance and
/// penalties for every edge too few and for quads between the legs that are too many or too few.
std::vector<Candidate> find_candidates(const SurfaceMesh& surface, const VertexTree& tree,
                                       const Domain& domain, const CurveNet& net, const RingChooser& rings,
                                       double least_reach) {
    std::vector<Candidate> candidates;
    for (Index a = 0; a < net.anchors.size(); ++a) {
        const auto legs = static_cast<int>(net.anchor_leg[a].size());
        if (legs == 0) continue;
        double factor = 1;
        for (Index l : net.anchor_leg[a])
            factor = std::max(factor, wedge_factor(domain.angle[net.legs[l].curve].smallest));
        const double reach = least_reach * factor;
        tree.visit_within(net.anchors[a].place, reach * tree.largest_size(), [&](Index v, double distance) {
            distance /= surface.size[v];
            if (distance > reach) return;
            const int missing = std::max(0, legs - usable_edges(surface, v));
            const RingChoice ring = rings.choose(a, v, [](Index, Index) { return 0.0; });
            const double sectors = kSectors * (ring.neighbour.empty() ? kNoRing : ring.sectors);
            candidates.push_back({distance + missing + sectors, a, v});
        });
    }
    std::sort(candidates.begin(), candidates.end());
    return candidates;
}

/// Edges for legs that one edge is to follow.
class EndEdges {
  public:
    EndEdges(const SurfaceMesh& surface, const std::vector<Point>& unfitted, const CurveNet& net,
             const std::vector<Candidate>& candidates)
        : surface_(surface), unfitted_(unfitted), net_(net), cost_(net.anchors.size()) {
        std::vector<std::uint8_t> wanted(net.anchors.size(), 0);
        for (Index l = 0; l < net.legs.size(); ++l)
            if (net.one_edge[l])
                for (Index a : net.legs[l].anchor) wanted[a] = 1;
        for (const Candidate& c : candidates)
            if (wanted[c.anchor]) cost_[c.anchor].try_emplace(c.vertex, c.cost);
    }

    /// Gives the legs' anchors the ends of free edges, the cheapest first.
    void take(std::vector<Index>& taken, std::vector<std::uint8_t>& used) const {
        std::vector<Choice> choices;
        for (Index l = 0; l < net_.legs.size(); ++l)
            if (net_.one_edge[l]) gather(l, choices);
        std::sort(choices.begin(), choices.end());
        for (const Choice& c : choices) {
            const auto [a, b] = net_.legs[c.leg].anchor;
            if (taken[a] != kNoIndex || taken[b] != kNoIndex || used[c.from] || used[c.to]) continue;
            taken[a] = c.from, taken[b] = c.to;
            used[c.from] = used[c.to] = 1;
        }
    }

  private:
    struct Choice {
        double cost;
        Index leg, from, to;
        auto operator<=>(const Choice&) const = default;
    };
    /// Least cosine of the angle between a leg and its edge where the mesh was not fitted yet: thin walls'
    /// sides are too close afterwards.
    static constexpr double kAlong = 0.6;

    void gather(Index l, std::vector<Choice>& choices) const {
        const Leg& leg = net_.legs[l];
        const Point along = glm::normalize(leg.points.back() - leg.points.front());
        for (const auto& [from, cost] : cost_[leg.anchor[0]])
            for (Index e : surface_.vertex_edge[from]) {
                const Index to = surface_.other_end(e, from);
                const auto other = cost_[leg.anchor[1]].find(to);
                if (!surface_.edge[e].ridge_allowed || other == cost_[leg.anchor[1]].end()) continue;
                const Point step = unfitted_[to] - unfitted_[from];
                if (glm::dot(step, along) > kAlong * glm::length(step))
                    choices.push_back({cost + other->second, l, from, to});
            }
    }

    const SurfaceMesh& surface_;
    const std::vector<Point>& unfitted_;
    const CurveNet& net_;
    std::vector<std::unordered_map<Index, double>> cost_; ///< per anchor of such a leg, of vertices
};

std::vector<Index> capture_anchors(const std::vector<Candidate>& candidates, const EndEdges& ends,
                                   std::size_t anchor_count, std::size_t vertex_count) {
    std::vector<Index> taken(anchor_count, kNoIndex);
    std::vector<std::uint8_t> used(vertex_count, 0);
    ends.take(taken, used);
    for (const Candidate& c : candidates) {
        if (taken[c.anchor] != kNoIndex || used[c.vertex]) continue;
        taken[c.anchor] = c.vertex;
        used[c.vertex] = 1;
    }
    return taken;
}

/// Shortest paths of one leg after the other.
class Router {
  public:
    Router(const SurfaceMesh& surface, const std::vector<Point>& placed, const Domain& domain,
           const CurveNet& net, const RingChooser& rings, const std::vector<Candidate>& candidates,
           const CaptureOptions& options, Capture& capture)
        : surface_(surface), placed_(placed), domain_(domain), net_(net), rings_(rings), options_(options),
          capture_(capture), anchor_at_(placed.size(), 0), leg_at_(placed.size(), kNoIndex),
          reserved_(placed.size(), kNoIndex), contested_(placed.size(), 0),
          next_candidate_(net.anchors.size(), 0), candidates_of_(net.anchors.size()),
          first_step_(net.legs.size(), {kNoIndex, kNoIndex}) {
        for (Index v : capture.anchor_vertex)
            if (v != kNoIndex) anchor_at_[v] = 1;
        for (const Candidate& c : candidates) candidates_of_[c.anchor].push_back(c.vertex);
    }

    void run(const Context& context) {
        for (Index a = 0; a < net_.anchors.size(); ++a) reserve_ring(a);
        std::vector<Index> order(net_.legs.size());
        std::iota(order.begin(), order.end(), Index{0});
        std::stable_sort(order.begin(), order.end(),
                         [&](Index a, Index b) { return net_.legs[a].length() < net_.legs[b].length(); });
        std::vector<Index> queue(order.rbegin(), order.rend());
        const int limit = std::max(60, options_.reroutes_a_leg * static_cast<int>(net_.legs.size()));
        while (!queue.empty() && !context.is_cancelled()) {
            const Index leg = queue.back();
            queue.pop_back();
            if (!has_anchors(leg)) continue;
            if (route(leg, false)) continue;
            if (capture_.reroutes >= limit || dropped_[leg] > kMaxDrops) continue;
            const std::vector<Index> hit = route_through(leg);
            queue.insert(queue.begin(), hit.begin(), hit.end());
            for (Index other : hit) {
                ++capture_.reroutes;
                if (++dropped_[other] % kDropsBeforeMove == 0) move_anchor(shared_anchor(leg, other), queue);
            }
        }
    }

  private:
    struct Step {
        double cost;
        Index vertex;
        auto operator<=>(const Step&) const = default;
    };

    /// After so many times a path was dropped, an anchor of it takes another vertex.
    static constexpr int kDropsBeforeMove = 3;
    static constexpr int kMaxDrops = 15;
    /// What it costs in edge lengths to leave an anchor by another edge than the one reserved: less than to
    /// go round the anchor for that one.
    static constexpr double kOtherStep = 1;
    /// A path this much longer than its leg goes round something: the quads between the two have no area once
    /// it is placed on the leg.
    static constexpr double kDetour = 2;
    /// What an edge costs that is another leg's already, in squared radians.
    static constexpr double kTaken = 20;

    /// An anchor of both legs, or else that of `other` whose vertex has fewer edges.
    Index shared_anchor(Index leg, Index other) const {
        for (Index a : net_.legs[leg].anchor)
            for (Index b : net_.legs[other].anchor)
                if (a == b) return a;
        const auto [a, b] = net_.legs[other].anchor;
        return usable_edges(surface_, capture_.anchor_vertex[a]) <=
                       usable_edges(surface_, capture_.anchor_vertex[b])
                   ? a
                   : b;
    }

    /// Gives an anchor the next best free vertex and routes its legs anew.
    void move_anchor(Index a, std::vector<Index>& queue) {
        const std::span<const Index> legs = net_.anchor_leg[a];
        if (std::any_of(legs.begin(), legs.end(), [&](Index leg) { return net_.one_edge[leg] != 0; })) return;
        Index& next = next_candidate_[a];
        while (next < candidates_of_[a].size() && !is_free(candidates_of_[a][next])) ++next;
        if (next == candidates_of_[a].size()) return;
        const Index old = capture_.anchor_vertex[a];
        for (Index leg : net_.anchor_leg[a]) {
            release(leg);
            for (Index& step : first_step_[leg]) {
                if (step != kNoIndex && reserved_[step] == leg) reserved_[step] = kNoIndex;
                step = kNoIndex;
            }
            if (std::find(queue.begin(), queue.end(), leg) == queue.end()) queue.insert(queue.begin(), leg);
        }
        anchor_at_[old] = 0;
        capture_.anchor_vertex[a] = candidates_of_[a][next++];
        anchor_at_[capture_.anchor_vertex[a]] = 1;
        reserve_ring(a);
    }

    bool is_free(Index v) const {
        return !anchor_at_[v] && leg_at_[v] == kNoIndex && reserved_[v] == kNoIndex;
    }

    bool has_anchors(Index leg) const {
        if (domain_.curve_open[net_.legs[leg].curve]) return false;
        const auto [a, b] = net_.legs[leg].anchor;
        return capture_.anchor_vertex[a] != kNoIndex && capture_.anchor_vertex[b] != kNoIndex;
    }

    /// Gives each leg at an anchor an edge of its own.
    void reserve_ring(Index a) {
        const Index v = capture_.anchor_vertex[a];
        if (v == kNoIndex) return;
        const RingChoice choice = rings_.choose(a, v, [&](Index u, Index leg) {
            return taken_by_other(u, leg) || (net_.one_edge[leg] && !anchor_at_[u]) ? kTaken : 0.0;
        });
        const std::span<const Index> legs = net_.anchor_leg[a];
        for (std::size_t l = 0; l < choice.neighbour.size(); ++l) {
            const Index u = choice.neighbour[l];
            if (taken_by_other(u, legs[l])) continue;
            first_step_[legs[l]][net_.legs[legs[l]].anchor[0] == a ? 0 : 1] = u;
            if (!anchor_at_[u]) reserved_[u] = legs[l];
        }
    }

    /// An anchor is a first step only of the legs that end there.
    bool taken_by_other(Index u, Index leg) const {
        if (anchor_at_[u])
            return u != capture_.anchor_vertex[net_.legs[leg].anchor[0]] &&
                   u != capture_.anchor_vertex[net_.legs[leg].anchor[1]];
        return reserved_[u] != kNoIndex && reserved_[u] != leg;
    }

    double leg_distance(Index leg, const Point& query) const {
        return distance_from_leg(net_, leg, domain_.model, query);
    }

    double reach_of(Index leg) const {
        return options_.path_reach * wedge_factor(domain_.angle[net_.legs[leg].curve].smallest);
    }

    double edge_weight(Index leg, double reach, Index from, Index to) const {
        const double h = 0.5 * (surface_.size[from] + surface_.size[to]);
        const double end = leg_distance(leg, placed_[to]) / h;
        if (end > reach) return kInfinity;
        const double middle = leg_distance(leg, 0.5 * (placed_[from] + placed_[to])) / h;
        return h * (0.1 + 4 * middle * middle + 4 * end * end);
    }

    /// 0.3 edge lengths where the step and the one before are sides of one quad.
    double fold_penalty(Index before, Index at, Index next) const {
        if (before == kNoIndex) return 0;
        for (Index q : surface_.vertex_quad[at]) {
            const Quad& quad = surface_.quad[q];
            if (std::find(quad.begin(), quad.end(), before) != quad.end() &&
                std::find(quad.begin(), quad.end(), next) != quad.end())
                return 0.3 * surface_.size[at];
        }
        return 0;
    }

    /// What it costs leg `leg` to pass v: 0 where free, infinite where it may not.
    double passage(Index leg, Index v, bool through) const {
        if (anchor_at_[v]) return v == target_ ? 0 : kInfinity;
        const bool foreign = (leg_at_[v] != kNoIndex && leg_at_[v] != leg) ||
                             (reserved_[v] != kNoIndex && reserved_[v] != leg);
        if (!foreign) return 0;
        return through ? (8 + 4 * contested_[v]) * surface_.size[v] : kInfinity;
    }

    /// Shortest path of a leg; `through`: other paths may be crossed, at a price.
    std::vector<Index> search(Index leg, bool through) {
        const Leg& l = net_.legs[leg];
        const Index source = capture_.anchor_vertex[l.anchor[0]];
        target_ = capture_.anchor_vertex[l.anchor[1]];
        const double reach = reach_of(leg);
        const auto [first, last] = first_step_[leg];
        std::unordered_map<Index, std::pair<double, Index>> best; // cost and predecessor
        std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
        best[source] = {0, kNoIndex};
        open.push({0, source});
        while (!open.empty()) {
            const auto [cost, v] = open.top();
            open.pop();
            const auto [known, before] = best.at(v);
            if (cost > known) continue;
            if (v == target_) break;
            for (Index e : surface_.vertex_edge[v]) {
                if (!surface_.edge[e].ridge_allowed) continue;
                const Index u = surface_.other_end(e, v);
                double other_step = 0;
                if (!through && v == source && first != kNoIndex && u != first)
                    other_step += kOtherStep * surface_.size[source];
                if (!through && u == target_ && last != kNoIndex && v != last)
                    other_step += kOtherStep * surface_.size[target_];
                const double pass = passage(leg, u, through);
                if (pass == kInfinity) continue;
                const double weight = edge_weight(leg, reach, v, u);
                if (weight == kInfinity) continue;
                const double total = cost + weight + pass + other_step + fold_penalty(before, v, u);
                const auto found = best.find(u);
                if (found != best.end() && found->second.first <= total) continue;
                best[u] = {total, v};
                open.push({total, u});
            }
        }
        std::vector<Index> path;
        if (best.find(target_) == best.end()) return path;
        for (Index v = target_; v != kNoIndex; v = best.at(v).second) path.push_back(v);
        std::reverse(path.begin(), path.end());
        return path;
    }

    void occupy(Index leg, std::vector<Index> path) {
        for (std::size_t i = 1; i + 1 < path.size(); ++i) leg_at_[path[i]] = leg;
        capture_.path[leg] = std::move(path);
    }

    void release(Index leg) {
        for (Index v : capture_.path[leg])
            if (leg_at_[v] == leg) leg_at_[v] = kNoIndex;
        capture_.path[leg].clear();
    }

    bool is_detour(Index leg, const std::vector<Index>& path) const {
        if (path.empty()) return false;
        double length = 0;
        for (std::size_t i = 1; i < path.size(); ++i)
            length += glm::distance(placed_[path[i - 1]], placed_[path[i]]);
        const double direct = glm::distance(placed_[path.front()], placed_[path.back()]);
        const double size = 0.5 * (surface_.size[path.front()] + surface_.size[path.back()]);
        return length > kDetour * std::max(direct, net_.legs[leg].length()) + size;
    }

    /// Gives back the edges that were reserved for a leg whose path took others.
    void free_unused_steps(Index leg, const std::vector<Index>& path) {
        for (int end : {0, 1}) {
            Index& step = first_step_[leg][end];
            if (step == kNoIndex || step == (end == 0 ? path[1] : path[path.size() - 2])) continue;
            if (reserved_[step] == leg) reserved_[step] = kNoIndex;
            step = kNoIndex;
        }
    }

    bool route(Index leg, bool through) {
        std::vector<Index> path = search(leg, through);
        if (path.empty() || is_detour(leg, path)) return false;
        free_unused_steps(leg, path);
        occupy(leg, std::move(path));
        return true;
    }

    /// Routes a leg through others and reservations; returns the legs that lost their paths.
    std::vector<Index> route_through(Index leg) {
        std::vector<Index> path = search(leg, true);
        if (is_detour(leg, path)) path.clear();
        std::vector<Index> hit;
        for (std::size_t i = 1; i + 1 < path.size(); ++i) {
            const Index v = path[i];
            if (const Index owner = reserved_[v]; owner != kNoIndex && owner != leg) {
                reserved_[v] = kNoIndex;
                for (Index& step : first_step_[owner])
                    if (step == v) step = kNoIndex;
            }
            if (leg_at_[v] != kNoIndex && leg_at_[v] != leg) {
                contested_[v] += 1;
                hit.push_back(leg_at_[v]);
                release(leg_at_[v]);
            }
        }
        if (!path.empty()) {
            first_step_[leg] = {kNoIndex, kNoIndex};
            occupy(leg, path);
        }
        return hit;
    }

    const SurfaceMesh& surface_;
    const std::vector<Point>& placed_;
    const Domain& domain_;
    const CurveNet& net_;
    const RingChooser& rings_;
    const CaptureOptions& options_;
    Capture& capture_;
    std::vector<std::uint8_t> anchor_at_; ///< per vertex
    std::vector<Index> leg_at_;           ///< per vertex: whose path passes
    std::vector<Index> reserved_;         ///< per vertex: for whose first or last step
    std::vector<float> contested_;        ///< per vertex: how often one path had another dropped there
    std::vector<Index> next_candidate_;   ///< per anchor: of candidates_of_
    std::vector<std::vector<Index>> candidates_of_; ///< per anchor: vertices, the best first
    std::vector<std::array<Index, 2>> first_step_;  ///< per leg: from its two ends
    std::unordered_map<Index, int> dropped_;        ///< per leg: how often
    Index target_ = kNoIndex;
};

} // namespace

Capture capture_features(const SurfaceMesh& surface, const std::vector<Point>& unfitted,
                         const std::vector<Point>& placed, const VertexTree& tree, const Domain& domain,
                         const CurveNet& net, const CaptureOptions& options, const Context& context) {
    Capture capture;
    const std::vector<CornerFan> fans = find_corner_fans(domain, net);
    const RingChooser rings(surface, placed, net, fans);
    const std::vector<Candidate> candidates =
        find_candidates(surface, tree, domain, net, rings, options.reach);
    capture.anchor_vertex = capture_anchors(candidates, EndEdges(surface, unfitted, net, candidates),
                                            net.anchors.size(), placed.size());
    capture.path.resize(net.legs.size());
    Router(surface, placed, domain, net, rings, candidates, options, capture).run(context);
    return capture;
}

} // namespace hexopt::fit
