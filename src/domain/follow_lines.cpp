#include "domain/follow_lines.hpp"

#include "domain/closest_point.hpp"
#include "domain/point_tree.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

namespace hexopt {

namespace {

using Edge = std::array<Index, 2>; ///< smaller vertex first

constexpr double kSagitta = 0.2; ///< of an edge: by how much more than its ends its middle may be off
/// Of an edge: how long the line beside it may be, so that edges cut no hairpin bends short.
constexpr double kLongest = 2, kShortest = 0.5;

/// Points of a line from one junction or end to the next; a closed one repeats its first point.
struct Chain {
    std::vector<Point> points;
    std::vector<double> along; ///< length of the line up to each point

    bool closed() const { return points.front() == points.back(); }
    double length() const { return along.back(); }
    void add(const Point& p) {
        along.push_back(points.empty() ? 0 : along.back() + glm::distance(points.back(), p));
        points.push_back(p);
    }
    Point at(double s) const {
        const auto after = std::lower_bound(along.begin() + 1, along.end() - 1, s);
        const auto k = static_cast<std::size_t>(after - along.begin());
        const double part = along[k] - along[k - 1];
        return glm::mix(points[k - 1], points[k], part > 0 ? (s - along[k - 1]) / part : 0.0);
    }
};

/// Joins segments at equal points, from one that does not join two segments to the next.
class ChainTracer {
  public:
    explicit ChainTracer(const FeatureLines& lines) {
        for (const auto& [a, b] : lines.segments) {
            const Index i = id_of(a), j = id_of(b);
            if (i == j || !known_.insert({std::min(i, j), std::max(i, j)}).second) continue;
            const auto s = static_cast<Index>(ends_.size());
            ends_.push_back({i, j});
            at_[i].push_back(s);
            at_[j].push_back(s);
        }
        used_.assign(ends_.size(), 0);
    }

    std::vector<Chain> trace() {
        std::vector<Chain> chains;
        for (bool from_ends : {true, false})
            for (Index p = 0; p < at_.size(); ++p) {
                if ((at_[p].size() != 2) != from_ends) continue;
                for (Index s : at_[p])
                    if (!used_[s]) chains.push_back(trace(p, s));
            }
        return chains;
    }

  private:
    struct Before {
        bool operator()(const Point& a, const Point& b) const {
            return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
        }
    };

    Index id_of(const Point& p) {
        const auto [entry, is_new] = ids_.try_emplace(p, static_cast<Index>(points_.size()));
        if (is_new) {
            points_.push_back(p);
            at_.emplace_back();
        }
        return entry->second;
    }

    Chain trace(Index start, Index segment) {
        Chain chain;
        chain.add(points_[start]);
        for (Index at = start;;) {
            used_[segment] = 1;
            at = ends_[segment][0] == at ? ends_[segment][1] : ends_[segment][0];
            chain.add(points_[at]);
            if (at == start || at_[at].size() != 2) return chain;
            segment = at_[at][0] == segment ? at_[at][1] : at_[at][0];
        }
    }

    std::map<Point, Index, Before> ids_;
    std::vector<Point> points_;
    std::set<Edge> known_;
    std::vector<std::array<Index, 2>> ends_; ///< per segment
    std::vector<std::vector<Index>> at_;     ///< per point: its segments
    std::vector<std::uint8_t> used_;
};

class LineFollower {
  public:
    LineFollower(std::span<const Point> positions, const SurfacePolygons& polygons,
                 std::span<const double> reach)
        : positions_(positions), reach_(reach), vertices_(vertices_of(polygons)), tree_(positions, vertices_),
          farthest_(0), stop_of_(positions.size(), kNoIndex) {
        for (Index v : vertices_) farthest_ = std::max(farthest_, reach[v]);
        find_neighbours(polygons);
    }

    void follow(const FeatureLines& lines, const Chain& chain) {
        std::vector<Stop> stops = find_stops(chain);
        const std::optional<Gap> lost = chain.closed() ? cut_open(stops, chain) : trim_ends(stops, chain);
        if (lost) return add_gap(lines, *lost);
        for (Index i = 0; i < stops.size(); ++i)
            if (stop_of_[stops[i].vertex] == kNoIndex) stop_of_[stops[i].vertex] = i;
        const std::vector<Index> before = find_ways(stops, chain);
        for (const Stop& stop : stops) stop_of_[stop.vertex] = kNoIndex;
        if (before.back() == kNoIndex) {
            Index reached = 0;
            for (Index i = 0; i < stops.size(); ++i)
                if (before[i] != kNoIndex) reached = i;
            return add_gap(lines, {place_at(stops[reached].along, chain), false});
        }
        for (auto i = static_cast<Index>(stops.size() - 1); i != 0; i = before[i]) {
            const Index a = stops[before[i]].vertex, b = stops[i].vertex;
            result_.edges.push_back({std::min(a, b), std::max(a, b)});
        }
    }

    FollowedLines take() {
        std::sort(result_.edges.begin(), result_.edges.end());
        result_.edges.erase(std::unique(result_.edges.begin(), result_.edges.end()), result_.edges.end());
        return std::move(result_);
    }

  private:
    /// A vertex that a chain of edges may pass.
    struct Stop {
        Index vertex;
        double along; ///< the line up to its closest point
        double distance;
    };
    struct Gap {
        Point place;
        bool at_end;
    };

    static std::vector<Index> vertices_of(const SurfacePolygons& polygons) {
        std::vector<Index> vertices = polygons.vertex.item;
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        return vertices;
    }

    void find_neighbours(const SurfacePolygons& polygons) {
        std::vector<std::array<Index, 2>> pairs;
        for (std::size_t f = 0; f < polygons.vertex.rows(); ++f) {
            const std::span<const Index> loop = polygons.vertex[f];
            for (std::size_t k = 0; k < loop.size(); ++k) {
                const Index a = loop[k], b = loop[(k + 1) % loop.size()];
                pairs.push_back({a, b});
                pairs.push_back({b, a});
            }
        }
        std::sort(pairs.begin(), pairs.end());
        pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
        neighbour_.offset.assign(positions_.size() + 1, 0);
        for (const auto& [a, b] : pairs) {
            ++neighbour_.offset[a + 1];
            neighbour_.item.push_back(b);
        }
        std::partial_sum(neighbour_.offset.begin(), neighbour_.offset.end(), neighbour_.offset.begin());
    }

    void add_gap(const FeatureLines& lines, const Gap& gap) {
        result_.gaps.push_back({&lines, gap.place, gap.at_end});
    }

    /// Vertices within reach of the line, in their order along it.
    std::vector<Stop> find_stops(const Chain& chain) const {
        std::vector<Stop> stops;
        for (std::size_t k = 0; k + 1 < chain.points.size(); ++k) {
            const Point &a = chain.points[k], &b = chain.points[k + 1];
            const double length = glm::distance(a, b);
            tree_.visit_within(glm::mix(a, b, 0.5), 0.5 * length + farthest_, [&](Index v) {
                const ClosestPoint<2> on = closest_on_segment(positions_[v], a, b);
                const double distance = glm::distance(on.point, positions_[v]);
                if (distance <= reach_[v])
                    stops.push_back({v, chain.along[k] + on.weight[1] * length, distance});
            });
        }
        std::sort(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) {
            return std::tie(a.vertex, a.distance, a.along) < std::tie(b.vertex, b.distance, b.along);
        });
        const auto same = [](const Stop& a, const Stop& b) { return a.vertex == b.vertex; };
        stops.erase(std::unique(stops.begin(), stops.end(), same), stops.end());
        sort_along(stops);
        return stops;
    }

    static void sort_along(std::vector<Stop>& stops) {
        std::sort(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) {
            return std::tie(a.along, a.distance, a.vertex) < std::tie(b.along, b.distance, b.vertex);
        });
    }

    /// Begins a closed line at the vertex that is nearest to it, which becomes the last stop too.
    std::optional<Gap> cut_open(std::vector<Stop>& stops, const Chain& chain) {
        if (stops.empty()) return Gap{chain.points.front(), false};
        const Stop first = *std::min_element(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) {
            return std::tie(a.distance, a.vertex) < std::tie(b.distance, b.vertex);
        });
        shift_ = first.along;
        for (Stop& stop : stops) {
            stop.along -= shift_;
            if (stop.along < 0) stop.along += chain.length();
        }
        sort_along(stops);
        const auto it = std::find_if(stops.begin(), stops.end(),
                                     [&](const Stop& stop) { return stop.vertex == first.vertex; });
        std::rotate(stops.begin(), it, it + 1);
        stops.push_back({first.vertex, chain.length(), first.distance});
        return std::nullopt;
    }

    /// Begins and ends a line at the vertices nearest to its ends.
    std::optional<Gap> trim_ends(std::vector<Stop>& stops, const Chain& chain) {
        shift_ = 0;
        std::array<Stop, 2> ends{};
        for (const bool last : {false, true}) {
            const Point& end = last ? chain.points.back() : chain.points.front();
            double nearest = std::numeric_limits<double>::max();
            for (const Stop& stop : stops) {
                const double distance = glm::distance(positions_[stop.vertex], end);
                if (distance > reach_[stop.vertex] || distance >= nearest) continue;
                nearest = distance;
                ends[last ? 1 : 0] = {stop.vertex, last ? chain.length() : 0, distance};
            }
            if (nearest == std::numeric_limits<double>::max()) return Gap{end, true};
        }
        std::erase_if(stops, [&](const Stop& stop) {
            return stop.vertex == ends[0].vertex || stop.vertex == ends[1].vertex;
        });
        stops.insert(stops.begin(), ends[0]);
        stops.push_back(ends[1]);
        return std::nullopt;
    }

    /// For every stop the one before it on the way from the first that is nearest to the line; the first
    /// one's is itself, kNoIndex where there is no way. Ways lead onwards along the line.
    std::vector<Index> find_ways(const std::vector<Stop>& stops, const Chain& chain) const {
        std::vector<Index> before(stops.size(), kNoIndex);
        std::vector<double> cost(stops.size(), std::numeric_limits<double>::max());
        before[0] = 0;
        cost[0] = 0;
        const auto last = static_cast<Index>(stops.size() - 1);
        for (Index i = 0; i < last; ++i) {
            if (before[i] == kNoIndex) continue;
            for (Index w : neighbour_[stops[i].vertex])
                for (const Index j : {stop_of_[w], w == stops[last].vertex ? last : kNoIndex}) {
                    if (j == kNoIndex || j <= i) continue;
                    if (i == 0 && j == last && chain.closed()) continue;
                    const double onwards = cost[i] + cost_of(stops[i], stops[j], chain);
                    if (onwards >= cost[j]) continue;
                    cost[j] = onwards;
                    before[j] = i;
                }
        }
        return before;
    }

    /// Place of a stop; they count from where a closed line was cut open.
    Point place_at(double along, const Chain& chain) const {
        const double s = along + shift_;
        return chain.at(s > chain.length() ? s - chain.length() : s);
    }

    /// Of an edge; the largest number where it does not follow the line.
    double cost_of(const Stop& a, const Stop& b, const Chain& chain) const {
        constexpr double kNot = std::numeric_limits<double>::max();
        const double length = glm::distance(positions_[a.vertex], positions_[b.vertex]);
        const double beside = b.along - a.along;
        if (beside > kLongest * length || beside < kShortest * length) return kNot;
        const Point half = glm::mix(positions_[a.vertex], positions_[b.vertex], 0.5);
        const double middle = glm::distance(half, place_at(0.5 * (a.along + b.along), chain));
        if (middle > std::max(reach_[a.vertex], reach_[b.vertex]) + kSagitta * length) return kNot;
        return length * (a.distance + b.distance + 2 * middle);
    }

    std::span<const Point> positions_;
    std::span<const double> reach_;
    std::vector<Index> vertices_;
    PointTree tree_;
    double farthest_; ///< reach of any vertex
    Csr<Index> neighbour_;
    std::vector<Index> stop_of_; ///< of the line at hand, per vertex
    double shift_ = 0;           ///< where a closed line was cut open, along it
    FollowedLines result_;
};

} // namespace

Result<FollowedLines> follow_lines(std::span<const Point> positions, const SurfacePolygons& polygons,
                                   std::span<const FeatureLines> lines, std::span<const double> reach,
                                   const Context& context) {
    LineFollower follower(positions, polygons, reach);
    for (const FeatureLines& file : lines)
        for (const Chain& chain : ChainTracer(file).trace()) {
            if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "features", "", "cancelled");
            follower.follow(file, chain);
        }
    return follower.take();
}

} // namespace hexopt
