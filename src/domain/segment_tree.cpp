#include "domain/segment_tree.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

constexpr Index kLeaf = 4;

bool meets_segment(const Box2& box, const SegmentTree::Segment& segment) {
    // Separating axes: those of the box are tested by the boxes; here the segment's normal.
    const Point2 d = segment[1] - segment[0], normal(-d.y, d.x);
    const Point2 centre = 0.5 * (box.low + box.high), half = 0.5 * (box.high - box.low);
    const double reach = std::abs(normal.x) * half.x + std::abs(normal.y) * half.y;
    return std::abs(glm::dot(normal, segment[0] - centre)) <= reach;
}

} // namespace

void Box2::add(const Point2& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
}

void Box2::add(const Box2& box) {
    add(box.low);
    add(box.high);
}

bool Box2::meets(const Box2& other) const {
    return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y;
}

double Box2::distance2(const Point2& p) const {
    const double dx = std::max({0.0, low.x - p.x, p.x - high.x});
    const double dy = std::max({0.0, low.y - p.y, p.y - high.y});
    return dx * dx + dy * dy;
}

double Box2::diagonal() const { return glm::distance(low, high); }

SegmentTree::SegmentTree(std::vector<Segment> segments) : segments_(std::move(segments)) {
    if (segments_.empty()) return;
    order_.resize(segments_.size());
    std::iota(order_.begin(), order_.end(), Index{0});
    nodes_.push_back({});
    build(0, 0, static_cast<Index>(segments_.size()));
}

void SegmentTree::build(Index node, Index first, Index last) {
    Box2 box, centres;
    const auto centre = [this](Index s) { return 0.5 * (segments_[s][0] + segments_[s][1]); };
    for (Index i = first; i < last; ++i) {
        for (const Point2& p : segments_[order_[i]]) box.add(p);
        centres.add(centre(order_[i]));
    }
    nodes_[node] = {box, first, last - first};
    if (last - first <= kLeaf) return;
    const int axis = centres.high.x - centres.low.x >= centres.high.y - centres.low.y ? 0 : 1;
    const Index middle = (first + last) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](Index a, Index b) {
                         const double x = centre(a)[axis], y = centre(b)[axis];
                         return x != y ? x < y : a < b;
                     });
    const auto child = static_cast<Index>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node].first = child;
    nodes_[node].count = 0;
    build(child, first, middle);
    build(child + 1, middle, last);
}

SegmentTree::Nearest SegmentTree::nearest(const Point2& p, double reach) const {
    Nearest best;
    if (nodes_.empty()) return best;
    double best2 = reach * reach;
    std::vector<std::pair<double, Index>> stack = {{nodes_[0].box.distance2(p), 0}};
    while (!stack.empty()) {
        const auto [bound, n] = stack.back();
        stack.pop_back();
        if (bound > best2) continue;
        const Node& node = nodes_[n];
        if (node.count == 0) {
            const double one = nodes_[node.first].box.distance2(p);
            const double two = nodes_[node.first + 1].box.distance2(p);
            const bool first_nearer = one <= two;
            stack.emplace_back(first_nearer ? two : one, node.first + (first_nearer ? 1 : 0));
            stack.emplace_back(first_nearer ? one : two, node.first + (first_nearer ? 0 : 1));
            continue;
        }
        for (Index i = node.first; i < node.first + node.count; ++i) {
            const Index s = order_[i];
            const Point2 a = segments_[s][0], d = segments_[s][1] - a;
            const double length2 = glm::dot(d, d);
            const double t = length2 > 0 ? std::clamp(glm::dot(p - a, d) / length2, 0.0, 1.0) : 0;
            const Point2 point = a + t * d;
            const double distance2 = glm::dot(p - point, p - point);
            if (distance2 > best2 || (distance2 == best2 && s > best.segment)) continue;
            best2 = distance2;
            best = {s, t, point, std::sqrt(distance2)};
        }
    }
    return best;
}

bool SegmentTree::meets(const Box2& box) const {
    bool found = false;
    visit_box(box, [&](Index s) {
        found = meets_segment(box, segments_[s]);
        return !found;
    });
    return found;
}

} // namespace hexopt
