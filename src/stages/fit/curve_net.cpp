#include "stages/fit/curve_net.hpp"

#include "domain/closest_point.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

namespace hexopt::fit {

namespace {

/// A curve whose ends are nearer to one another than this part of its length is cut, lest its path take the
/// short way.
constexpr double kDirect = 0.5;

Leg make_leg(Index curve, Index from, Index to, std::vector<Point> points) {
    Leg leg{curve, {from, to}, std::move(points), {0}};
    for (std::size_t i = 1; i < leg.points.size(); ++i)
        leg.arc_length.push_back(leg.arc_length.back() + glm::distance(leg.points[i - 1], leg.points[i]));
    return leg;
}

/// The points of `whole` from arc length a to b.
std::vector<Point> cut(const Leg& whole, double a, double b) {
    std::vector<Point> points = {point_at(whole, a)};
    for (std::size_t i = 0; i < whole.points.size(); ++i)
        if (whole.arc_length[i] > a && whole.arc_length[i] < b) points.push_back(whole.points[i]);
    points.push_back(point_at(whole, b));
    return points;
}

/// Cuts a curve at way points of equal arc.
void add_pieces(Index curve, const Leg& whole, CurveNet& net) {
    constexpr int kPieces = 4;
    std::array<Index, kPieces + 1> anchor;
    const auto add_way_point = [&](int k) {
        net.anchors.push_back({point_at(whole, k * whole.length() / kPieces), kNoIndex, curve});
        return static_cast<Index>(net.anchors.size() - 1);
    };
    anchor[0] = whole.anchor[0] == kNoIndex ? add_way_point(0) : whole.anchor[0];
    for (int k = 1; k < kPieces; ++k) anchor[k] = add_way_point(k);
    anchor[kPieces] = whole.anchor[1] == kNoIndex ? anchor[0] : whole.anchor[1];
    for (int k = 0; k < kPieces; ++k)
        net.legs.push_back(
            make_leg(curve, anchor[k], anchor[k + 1],
                     cut(whole, k * whole.length() / kPieces, (k + 1) * whole.length() / kPieces)));
}

/// The legs of one curve, whose ends are where the corners are that stand for its own.
void add_legs(Index c, const Domain& domain, const SmallFeatures& small, CurveNet& net) {
    const std::span<const Point> points = domain.model.curve_points(c);
    std::vector<Point> chain(points.begin(), points.end());
    std::array<Index, 2> ends = domain.model.curve_ends(c);
    for (int k = 0; k < 2; ++k) {
        if (ends[k] == kNoIndex || small.corner[ends[k]] == ends[k]) continue;
        ends[k] = small.corner[ends[k]];
        chain.insert(k == 0 ? chain.begin() : chain.end(), domain.model.corner_point(ends[k]));
    }
    Leg whole = make_leg(c, ends[0], ends[1], std::move(chain));
    if (glm::distance(whole.points.front(), whole.points.back()) < kDirect * whole.length())
        add_pieces(c, whole, net);
    else
        net.legs.push_back(std::move(whole));
}

} // namespace

CurveNet make_curve_net(const Domain& domain, const SmallFeatures& small) {
    CurveNet net;
    net.too_small = small.too_small;
    const BoundaryModel& model = domain.model;
    for (Index c = 0; c < model.corner_count(); ++c)
        net.anchors.push_back({model.corner_point(c), c, kNoIndex});
    for (Index c = 0; c < model.curve_count(); ++c) {
        const auto first = static_cast<Index>(net.legs.size());
        if (!small.too_small[c]) add_legs(c, domain, small, net);
        net.curve_legs.push_back({first, static_cast<Index>(net.legs.size())});
        net.one_edge.resize(net.legs.size(), net.legs.size() == first + 1 && small.one_edge[c]);
    }
    std::vector<std::vector<Index>> at(net.anchors.size());
    for (Index l = 0; l < net.legs.size(); ++l)
        if (!domain.curve_open[net.legs[l].curve])
            for (Index a : net.legs[l].anchor) at[a].push_back(l);
    for (const std::vector<Index>& legs : at) {
        net.anchor_leg.item.insert(net.anchor_leg.item.end(), legs.begin(), legs.end());
        net.anchor_leg.offset.push_back(net.anchor_leg.item.size());
    }
    return net;
}

Point point_at(const Leg& leg, double s) {
    const auto above = std::upper_bound(leg.arc_length.begin(), leg.arc_length.end(), s);
    if (above == leg.arc_length.begin()) return leg.points.front();
    if (above == leg.arc_length.end()) return leg.points.back();
    const std::size_t i = static_cast<std::size_t>(above - leg.arc_length.begin());
    const double t = (s - leg.arc_length[i - 1]) / (leg.arc_length[i] - leg.arc_length[i - 1]);
    return leg.points[i - 1] + t * (leg.points[i] - leg.points[i - 1]);
}

double closest_arc_length(const Leg& leg, const Point& query) {
    double best = std::numeric_limits<double>::infinity(), arc = 0;
    for (std::size_t i = 0; i + 1 < leg.points.size(); ++i) {
        const ClosestPoint<2> at = closest_on_segment(query, leg.points[i], leg.points[i + 1]);
        const double distance = glm::distance(query, at.point);
        if (distance < best) {
            best = distance;
            arc = leg.arc_length[i] + at.weight[1] * (leg.arc_length[i + 1] - leg.arc_length[i]);
        }
    }
    return arc;
}

double distance_from_leg(const CurveNet& net, Index leg, const BoundaryModel& model, const Point& query) {
    const Leg& l = net.legs[leg];
    const auto [first, last] = net.curve_legs[l.curve];
    if (last == first + 1) return model.project_curve(l.curve, query).distance;
    return glm::distance(query, point_at(l, closest_arc_length(l, query)));
}

} // namespace hexopt::fit
