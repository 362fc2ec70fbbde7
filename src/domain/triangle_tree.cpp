#include "domain/triangle_tree.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace hexopt {

namespace {

/// A line through an edge meets both triangles there rather than none: barycentric coordinates.
constexpr double kSlack = 1e-12;

} // namespace

struct TriangleTree::Build {
    TriangleTree& tree;
    std::span<const Corners> triangles;
    std::vector<Point> centroid;

    std::size_t split(std::span<Index> order) const {
        Box centres;
        for (Index t : order) centres.add(centroid[t]);
        const Point extent = centres.high - centres.low;
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (extent[k] > extent[axis]) axis = k;
        const std::size_t middle = order.size() / 2;
        std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                         [&](Index a, Index b) {
                             const double x = centroid[a][axis], y = centroid[b][axis];
                             return x != y ? x < y : a < b;
                         });
        return middle;
    }

    void summarise(Node& node, std::span<const Index> order) const {
        double area = 0;
        node.centre = node.dipole = Point(0);
        for (Index t : order) {
            const Corners& x = triangles[t];
            const Point vector_area = 0.5 * glm::cross(x[1] - x[0], x[2] - x[0]);
            const double a = glm::length(vector_area);
            area += a;
            node.centre += a * centroid[t];
            node.dipole += vector_area;
            for (const Point& p : x) node.box.add(p);
        }
        node.centre = area > 0 ? node.centre / area : node.box.centre();
        node.radius2 = 0;
        for (Index t : order)
            for (const Point& p : triangles[t])
                node.radius2 = std::max(node.radius2, glm::dot(p - node.centre, p - node.centre));
    }

    void add(std::span<Index> order, Index first_item) {
        const std::size_t self = tree.nodes_.size();
        tree.nodes_.emplace_back();
        Node node{};
        summarise(node, order);
        if (order.size() <= kLeafSize) {
            node.right = first_item;
            node.count = static_cast<Index>(order.size());
            tree.nodes_[self] = node;
            return;
        }
        const std::size_t middle = split(order);
        add(order.first(middle), first_item);
        node.right = static_cast<Index>(tree.nodes_.size());
        node.count = 0;
        tree.nodes_[self] = node;
        add(order.subspan(middle), first_item + static_cast<Index>(middle));
    }
};

TriangleTree::TriangleTree(std::span<const Corners> triangles) {
    if (triangles.empty()) return;
    Build build{*this, triangles, {}};
    build.centroid.reserve(triangles.size());
    for (const Corners& x : triangles) build.centroid.push_back((x[0] + x[1] + x[2]) / 3.0);
    triangle_.resize(triangles.size());
    std::iota(triangle_.begin(), triangle_.end(), Index{0});
    nodes_.reserve(triangles.size());
    build.add(triangle_, 0);
    corners_.reserve(triangles.size());
    for (Index t : triangle_) corners_.push_back(triangles[t]);
}

double triangle_winding(const TriangleTree::Corners& x, const Point& p) {
    const Point a = x[0] - p, b = x[1] - p, c = x[2] - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double volume = glm::dot(a, glm::cross(b, c));
    const double flat = la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    if (volume == 0) return 0;
    if (std::abs(volume) < 0.2 * flat) { // most triangles are small: the series errs by 1e-9 at most
        const double s = volume / flat, s2 = s * s;
        return s * (1 - s2 * (1.0 / 3 - s2 * (1.0 / 5 - s2 * (1.0 / 7 - s2 / 9)))) / (2 * std::numbers::pi);
    }
    return std::atan2(volume, flat) / (2 * std::numbers::pi);
}

double TriangleTree::winding_number(const Point& p, double beta) const {
    double sum = 0;
    const double beta2 = beta * beta;
    walk(
        [&](const Node& node) {
            const Point r = node.centre - p;
            const double d2 = glm::dot(r, r);
            if (!(d2 > beta2 * node.radius2)) return true;
            sum += glm::dot(node.dipole, r) / (4 * std::numbers::pi * d2 * std::sqrt(d2));
            return false;
        },
        [&](Index item) {
            sum += triangle_winding(corners_[item], p);
            return false;
        });
    return sum;
}

bool TriangleTree::meets(const Box& box, const Point& from, const Point& inverse, double low, double high) {
    const double slack = 1e-12 * (high - low);
    for (int k = 0; k < 3; ++k) {
        // A direction of 0 gives infinities, or NaN on the box's plane, which min and max let pass.
        const double t0 = (box.low[k] - from[k]) * inverse[k], t1 = (box.high[k] - from[k]) * inverse[k];
        low = std::max(low, std::min(t0, t1));
        high = std::min(high, std::max(t0, t1));
    }
    return low <= high + slack;
}

bool TriangleTree::intersect(const Corners& x, const Point& from, const Point& direction, double& t,
                             bool& leaving) {
    const Point e1 = x[1] - x[0], e2 = x[2] - x[0];
    const Point h = glm::cross(direction, e2);
    const double det = glm::dot(e1, h);
    if (det == 0) return false;
    const Point s = from - x[0];
    const double u = glm::dot(s, h) / det;
    if (!(u >= -kSlack && u <= 1 + kSlack)) return false;
    const Point q = glm::cross(s, e1);
    const double v = glm::dot(direction, q) / det;
    if (!(v >= -kSlack && u + v <= 1 + kSlack)) return false;
    t = glm::dot(e2, q) / det;
    leaving = det < 0;
    return true;
}

} // namespace hexopt
