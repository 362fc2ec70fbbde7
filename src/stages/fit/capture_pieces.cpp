#include "stages/fit/capture.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <queue>
#include <unordered_map>

namespace hexopt::fit {

namespace {

/// In local edge lengths: how far from the curve a piece may run and end, what it must at least span, how far
/// it stays from the piece that comes from the other end, and how far it may go back.
constexpr double kNear = 1.2, kEndNear = 0.6, kShortest = 1.5, kApart = 1.2, kBack = 0.2;
constexpr std::size_t kFewestEdges = 2;

class PieceFinder {
  public:
    PieceFinder(const SurfaceMesh& surface, const std::vector<Point>& placed, const VertexTree& tree,
                const Domain& domain, const CurveNet& net, Capture& capture)
        : surface_(surface), placed_(placed), tree_(tree), domain_(domain), net_(net), capture_(capture),
          taken_(placed.size(), 0) {
        for (const std::vector<Index>& path : capture.path)
            for (Index v : path) taken_[v] = 1;
        for (Index v : capture.anchor_vertex)
            if (v != kNoIndex) taken_[v] = 1;
    }

    void run(const Context& context) {
        std::vector<Index> order;
        for (Index l = 0; l < net_.legs.size(); ++l)
            if (capture_.path[l].empty() && !domain_.curve_open[net_.legs[l].curve]) order.push_back(l);
        std::stable_sort(order.begin(), order.end(),
                         [&](Index a, Index b) { return net_.legs[a].length() > net_.legs[b].length(); });
        for (Index l : order)
            if (!context.is_cancelled()) find_pieces(l);
    }

  private:
    struct Reached {
        double cost, arc;
        Index before;
    };
    struct Step {
        double cost;
        Index vertex;
        auto operator<=>(const Step&) const = default;
    };
    using Span = std::array<double, 2>; ///< of arc length

    void find_pieces(Index l) {
        const Leg& leg = net_.legs[l];
        Span left = {0, leg.length()};
        for (bool forward : {true, false}) {
            const Index v = capture_.anchor_vertex[leg.anchor[forward ? 0 : 1]];
            if (v == kNoIndex) continue;
            std::vector<Index> path = grow(l, v, forward, left);
            if (path.size() <= kFewestEdges) continue;
            const Index end = path.back();
            const double arc = closest_arc_length(leg, placed_[end]);
            left[forward ? 0 : 1] = arc + (forward ? kApart : -kApart) * surface_.size[end];
            if (!forward) std::reverse(path.begin(), path.end());
            take(l, std::move(path));
        }
        fill(l, left);
    }

    /// Pieces between two arc lengths: from a vertex as near as possible to the middle to both sides, then
    /// what is left before and after.
    void fill(Index l, const Span& span) {
        const Leg& leg = net_.legs[l];
        for (double part : {0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875}) {
            const Point place = point_at(leg, span[0] + part * (span[1] - span[0]));
            const Index v = tree_.nearest(place);
            if (v == kNoIndex || span[1] - span[0] < kFewestEdges * surface_.size[v]) return;
            if (taken_[v] || glm::distance(placed_[v], place) > kEndNear * surface_.size[v]) continue;
            const std::vector<Index> ahead = grow(l, v, true, span);
            for (Index u : ahead) taken_[u] = 1;
            std::vector<Index> path = grow(l, v, false, span);
            for (Index u : ahead) taken_[u] = 0;
            std::reverse(path.begin(), path.end());
            if (path.empty()) path.push_back(v);
            path.insert(path.end(), ahead.begin() + (ahead.empty() ? 0 : 1), ahead.end());
            if (path.size() <= kFewestEdges) continue;
            const Index first = path.front(), last = path.back();
            take(l, std::move(path));
            fill(l, {span[0], closest_arc_length(leg, placed_[first]) - kApart * surface_.size[first]});
            fill(l, {closest_arc_length(leg, placed_[last]) + kApart * surface_.size[last], span[1]});
            return;
        }
    }

    void take(Index l, std::vector<Index> path) {
        for (Index v : path) taken_[v] = 1;
        capture_.pieces.push_back({l, std::move(path)});
    }

    double offset(Index leg, const Point& query, double size) const {
        return distance_from_leg(net_, leg, domain_.model, query) / size;
    }

    /// The way of least deviation along the leg from `source` as far as it goes; empty if it does not get
    /// far.
    std::vector<Index> grow(Index l, Index source, bool forward, const Span& span) const {
        const Leg& leg = net_.legs[l];
        std::unordered_map<Index, Reached> reached;
        std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
        const double start = std::clamp(closest_arc_length(leg, placed_[source]), span[0], span[1]);
        reached[source] = {0, start, kNoIndex};
        open.push({0, source});
        Index best = source;
        double farthest = kShortest * surface_.size[source];
        while (!open.empty()) {
            const auto [cost, v] = open.top();
            open.pop();
            const Reached at = reached.at(v);
            if (cost > at.cost) continue;
            const double progress = forward ? at.arc - start : start - at.arc;
            if (progress > farthest && offset(l, placed_[v], surface_.size[v]) < kEndNear) {
                farthest = progress;
                best = v;
            }
            for (Index e : surface_.vertex_edge[v]) {
                const Index u = surface_.other_end(e, v);
                if (!surface_.edge[e].ridge_allowed || taken_[u]) continue;
                const Reached next = step(l, v, at, u, forward);
                if (next.cost == std::numeric_limits<double>::infinity()) continue;
                if (next.arc < span[0] || next.arc > span[1]) continue;
                const auto found = reached.find(u);
                if (found != reached.end() && found->second.cost <= next.cost) continue;
                reached[u] = next;
                open.push({next.cost, u});
            }
        }
        std::vector<Index> path;
        if (best == source) return path;
        for (Index v = best; v != kNoIndex; v = reached.at(v).before) path.push_back(v);
        std::reverse(path.begin(), path.end());
        return path;
    }

    Reached step(Index l, Index from, const Reached& at, Index to, bool forward) const {
        constexpr double kNever = std::numeric_limits<double>::infinity();
        const double h = 0.5 * (surface_.size[from] + surface_.size[to]);
        const double end = offset(l, placed_[to], h);
        if (end > kNear) return {kNever, 0, from};
        const double arc = closest_arc_length(net_.legs[l], placed_[to]);
        const double progress = forward ? arc - at.arc : at.arc - arc;
        if (progress < -kBack * h || progress > 3 * h) return {kNever, 0, from};
        const double middle = offset(l, 0.5 * (placed_[from] + placed_[to]), h);
        return {at.cost + h * (0.1 + 4 * middle * middle + 4 * end * end), arc, from};
    }

    const SurfaceMesh& surface_;
    const std::vector<Point>& placed_;
    const VertexTree& tree_;
    const Domain& domain_;
    const CurveNet& net_;
    Capture& capture_;
    std::vector<std::uint8_t> taken_; ///< per vertex: on a path, or an anchor's
};

} // namespace

void capture_pieces(const SurfaceMesh& surface, const std::vector<Point>& placed, const VertexTree& tree,
                    const Domain& domain, const CurveNet& net, Capture& capture, const Context& context) {
    PieceFinder(surface, placed, tree, domain, net, capture).run(context);
}

} // namespace hexopt::fit
