#include "stages/fit/corner_fans.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>

namespace hexopt::fit {

namespace {

constexpr std::size_t kMostLegs = 6, kMostEdges = 8;
/// What the numbers of quads count against squared angles.
constexpr double kSectorWeight = 1;
/// Angles of the surface below this count as this: no number of quads suits them.
constexpr double kLeastAngle_deg = 20;
/// Of legs in another order than round the corner, and of vertices round which quads have no order.
constexpr double kWrongOrder = 5, kNoOrder = 0.5;

struct PointLess {
    bool operator()(const Point& a, const Point& b) const {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    }
};

double angle_between(const Point& a, const Point& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Triangles that meet at a point: from the far end of the edge before to that of the edge after it.
struct Fan {
    std::vector<std::array<Point, 2>> sides;
};

/// The second point of a leg, seen from an anchor.
const Point& towards(const Leg& leg, Index anchor) {
    return leg.anchor[0] == anchor ? leg.points[1] : leg.points[leg.points.size() - 2];
}

CornerFan follow_fan(const Fan& fan, const Point& centre, Index anchor, std::span<const Index> legs,
                     const CurveNet& net) {
    CornerFan result;
    std::vector<std::uint8_t> used(legs.size(), 0);
    const auto leg_at = [&](const Point& p) {
        std::size_t found = legs.size();
        for (std::size_t k = 0; k < legs.size(); ++k)
            if (towards(net.legs[legs[k]], anchor) == p) found = k;
        return found;
    };
    const Point start = towards(net.legs[legs[0]], anchor);
    Point at = start;
    double angle = 0;
    for (std::size_t steps = 0; steps <= fan.sides.size(); ++steps) {
        if (const std::size_t k = leg_at(at); k < legs.size() && !(steps > 0 && at == start)) {
            if (!result.leg.empty()) result.angle_deg.push_back(angle);
            result.leg.push_back(legs[k]);
            angle = 0;
        }
        if (steps > 0 && at == start) {
            result.angle_deg.push_back(angle);
            return result.leg.size() == legs.size() ? result : CornerFan{};
        }
        const auto side = std::find_if(fan.sides.begin(), fan.sides.end(),
                                       [&](const std::array<Point, 2>& s) { return s[0] == at; });
        if (side == fan.sides.end()) return {};
        angle += angle_between((*side)[0] - centre, (*side)[1] - centre) * 180 / std::numbers::pi;
        at = (*side)[1];
    }
    return {};
}

/// Edges round a vertex, counter-clockwise; empty where hanging vertices interrupt them.
std::vector<Index> edges_round(const SurfaceMesh& surface, Index v) {
    std::vector<std::array<Index, 2>> steps; // edges before and after a quad
    for (Index q : surface.vertex_quad[v]) {
        const Quad& quad = surface.quad[q];
        const auto k = static_cast<std::size_t>(std::find(quad.begin(), quad.end(), v) - quad.begin());
        steps.push_back({surface.quad_edge[q][k], surface.quad_edge[q][(k + 3) % 4]});
    }
    std::vector<Index> order;
    Index at = steps.empty() ? kNoIndex : steps[0][0];
    for (std::size_t n = 0; n < steps.size(); ++n) {
        const auto step = std::find_if(steps.begin(), steps.end(), [&](const auto& s) { return s[0] == at; });
        if (step == steps.end()) return {};
        order.push_back(at);
        at = (*step)[1];
    }
    return at == order.front() ? order : std::vector<Index>{};
}

/// What the numbers of quads between legs cost. place: per leg of the fan, of its edge among the vertex's.
double sector_cost(const CornerFan& fan, std::span<const std::size_t> place, std::size_t edges) {
    double cost = 0;
    std::size_t sum = 0;
    for (std::size_t k = 0; k < place.size(); ++k) {
        const std::size_t quads = (place[(k + 1) % place.size()] + edges - place[k] - 1) % edges + 1;
        const double needed = std::max(fan.angle_deg[k], kLeastAngle_deg) / 90;
        const double ratio = std::log(needed / static_cast<double>(quads));
        cost += ratio * ratio;
        sum += quads;
    }
    return sum > edges ? kWrongOrder : cost;
}

} // namespace

std::vector<CornerFan> find_corner_fans(const Domain& domain, const CurveNet& net) {
    std::map<Point, Fan, PointLess> fan_at;
    for (Index a = 0; a < net.anchors.size(); ++a)
        if (net.anchors[a].corner != kNoIndex && net.anchor_leg[a].size() > 1) fan_at[net.anchors[a].place];
    for (Index t = 0; t < domain.model.triangle_count(); ++t) {
        const auto& corner = domain.model.triangle(t);
        for (std::size_t k = 0; k < 3; ++k)
            if (const auto found = fan_at.find(corner[k]); found != fan_at.end())
                found->second.sides.push_back({corner[(k + 1) % 3], corner[(k + 2) % 3]});
    }
    std::vector<CornerFan> fans(net.anchors.size());
    for (Index a = 0; a < fans.size(); ++a) {
        const std::span<const Index> legs = net.anchor_leg[a];
        if (legs.size() < 2) continue;
        if (net.anchors[a].corner == kNoIndex)
            fans[a] = {{legs.begin(), legs.end()},
                       std::vector<double>(legs.size(), 360.0 / static_cast<double>(legs.size()))};
        else
            fans[a] = follow_fan(fan_at.at(net.anchors[a].place), net.anchors[a].place, a, legs, net);
    }
    return fans;
}

RingChooser::RingChooser(const SurfaceMesh& surface, const std::vector<Point>& placed, const CurveNet& net,
                         const std::vector<CornerFan>& fans)
    : surface_(surface), placed_(placed), net_(net), fans_(fans) {}

namespace {

/// All ways to give each leg an edge of its own.
class Search {
  public:
    Search(const std::vector<std::vector<double>>& cost, const CornerFan& fan,
           std::vector<std::size_t> row_of_fan, std::vector<std::size_t> place, std::size_t edges)
        : cost_(cost), fan_(fan), row_of_fan_(std::move(row_of_fan)), place_(std::move(place)), edges_(edges),
          choice_(cost.size()) {}

    void run() { choose(0, 0, 0); }
    std::vector<std::size_t> best;
    double sectors = 0;

  private:
    void choose(std::size_t row, unsigned used, double sum) {
        if (sum >= least_) return;
        if (row < cost_.size()) {
            for (std::size_t k = 0; k < cost_[row].size(); ++k) {
                if (used >> k & 1) continue;
                choice_[row] = k;
                choose(row + 1, used | 1u << k, sum + cost_[row][k]);
            }
            return;
        }
        const double of_sectors = measure();
        if (sum + kSectorWeight * of_sectors >= least_) return;
        least_ = sum + kSectorWeight * of_sectors;
        sectors = of_sectors;
        best = choice_;
    }

    double measure() const {
        if (fan_.leg.empty() || place_.empty()) return kNoOrder;
        std::vector<std::size_t> at;
        for (std::size_t row : row_of_fan_) at.push_back(place_[choice_[row]]);
        return sector_cost(fan_, at, edges_);
    }

    const std::vector<std::vector<double>>& cost_;
    const CornerFan& fan_;
    std::vector<std::size_t> row_of_fan_, place_;
    std::size_t edges_;
    std::vector<std::size_t> choice_;
    double least_ = std::numeric_limits<double>::infinity();
};

/// Direction in which leg l leaves anchor a, seen from one edge length away.
Point direction_of(const CurveNet& net, Index l, Index a, double size) {
    const Leg& leg = net.legs[l];
    const double ahead = std::min(1.5 * size, 0.5 * leg.length());
    return point_at(leg, leg.anchor[0] == a ? ahead : leg.length() - ahead) - net.anchors[a].place;
}

} // namespace

RingChoice RingChooser::choose(Index anchor, Index vertex,
                               const std::function<double(Index, Index)>& extra) const {
    const std::span<const Index> legs = net_.anchor_leg[anchor];
    RingChoice result;
    if (legs.empty() || legs.size() > kMostLegs) return result;
    const std::vector<Index> order = edges_round(surface_, vertex);
    std::vector<Index> neighbour;
    std::vector<std::size_t> place;
    for (Index e : surface_.vertex_edge[vertex]) {
        if (!surface_.edge[e].ridge_allowed) continue;
        neighbour.push_back(surface_.other_end(e, vertex));
        if (!order.empty())
            place.push_back(
                static_cast<std::size_t>(std::find(order.begin(), order.end(), e) - order.begin()));
    }
    if (neighbour.size() < legs.size() || neighbour.size() > kMostEdges) return result;
    std::vector<std::vector<double>> cost(legs.size());
    for (std::size_t l = 0; l < legs.size(); ++l) {
        const Point d = direction_of(net_, legs[l], anchor, surface_.size[vertex]);
        for (Index u : neighbour) {
            const double angle = angle_between(d, placed_[u] - net_.anchors[anchor].place);
            cost[l].push_back(angle * angle + extra(u, legs[l]));
        }
    }
    std::vector<std::size_t> row_of_fan;
    for (Index l : fans_[anchor].leg)
        row_of_fan.push_back(static_cast<std::size_t>(std::find(legs.begin(), legs.end(), l) - legs.begin()));
    Search search(cost, fans_[anchor], std::move(row_of_fan), std::move(place), order.size());
    search.run();
    result.sectors = search.sectors;
    for (std::size_t k : search.best) result.neighbour.push_back(neighbour[k]);
    return result;
}

} // namespace hexopt::fit
