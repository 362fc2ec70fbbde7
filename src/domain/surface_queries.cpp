#include "domain/surface_queries.hpp"

#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 256;

std::vector<TriangleTree::Corners> corners_of(const BoundaryModel& model) {
    std::vector<TriangleTree::Corners> corners;
    corners.reserve(model.triangle_count());
    for (Index t = 0; t < model.triangle_count(); ++t) corners.push_back(model.triangle(t));
    return corners;
}

/// Whether every edge has as many triangles in one direction as in the other.
bool has_balanced_edges(const BoundaryModel& model) {
    std::vector<Point> corners;
    corners.reserve(3 * model.triangle_count());
    for (Index t = 0; t < model.triangle_count(); ++t)
        corners.insert(corners.end(), model.triangle(t).begin(), model.triangle(t).end());
    const std::vector<Index> first = find_first_equal(corners);
    struct Edge {
        std::array<Index, 2> ends;
        int direction;
    };
    std::vector<Edge> edges;
    edges.reserve(corners.size());
    for (std::size_t t = 0; t < corners.size(); t += 3)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = first[t + k], b = first[t + (k + 1) % 3];
            edges.push_back({{std::min(a, b), std::max(a, b)}, a < b ? 1 : -1});
        }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.ends < b.ends; });
    for (std::size_t i = 0; i < edges.size();) {
        int balance = 0;
        std::size_t end = i;
        for (; end < edges.size() && edges[end].ends == edges[i].ends; ++end) balance += edges[end].direction;
        if (balance != 0) return false;
        i = end;
    }
    return true;
}

/// No edge of a model made by hand lies along one of these.
const std::array<Point, 5> kRays = {Point(0.5377, 0.4231, 0.7294), Point(-0.6113, 0.7487, -0.2563),
                                    Point(0.2718, -0.5772, -0.7701), Point(-0.3141, -0.6931, 0.6488),
                                    Point(0.8321, -0.1732, 0.5267)};

/// Winding number by the sense of the triangles that a ray meets.
int count_ray(const TriangleTree& tree, const Point& p, const Point& direction, double far) {
    int winding = 0;
    tree.visit_line(p, direction, 0, far, [&](Index, double, bool leaving) { winding += leaving ? 1 : -1; });
    return winding;
}

} // namespace

SurfaceQueries::SurfaceQueries(const BoundaryModel& model)
    : model_(model), tree_(corners_of(model)), closed_(has_balanced_edges(model)) {}

double SurfaceQueries::winding_number(const Point& p) const {
    if (closed_) {
        // A ray errs only where it meets an edge: the first number that comes twice is right.
        const Box& box = tree_.box();
        const Point beyond = glm::max(glm::abs(p - box.low), glm::abs(p - box.high));
        std::array<int, kRays.size()> counted;
        for (std::size_t i = 0; i < kRays.size(); ++i) {
            counted[i] = count_ray(tree_, p, kRays[i], 4 * (beyond.x + beyond.y + beyond.z));
            for (std::size_t j = 0; j < i; ++j)
                if (counted[j] == counted[i]) return counted[i];
        }
    }
    // Dipoles err by a few per cent at beta = 2: whoever is near a threshold is asked again.
    double winding = 0;
    for (const auto& [beta, doubt] : {std::pair(2.0, 0.3), std::pair(5.0, 0.05), std::pair(12.0, 0.0)}) {
        winding = tree_.winding_number(p, beta);
        if (std::min(std::abs(winding - inside_.low), std::abs(winding - inside_.high)) >= doubt) break;
    }
    return winding;
}

std::vector<std::uint8_t> SurfaceQueries::are_inside(std::span<const Point> points,
                                                     const Parallel& parallel) const {
    std::vector<std::uint8_t> inside(points.size());
    parallel.for_each(points.size(), kChunk, [&](std::size_t i) { inside[i] = is_inside(points[i]); });
    return inside;
}

double SurfaceQueries::signed_depth(const Point& p, Index hint) const {
    const double distance = model_.distance(p, hint);
    return is_inside(p) ? distance : -distance;
}

std::vector<double> SurfaceQueries::signed_depths(std::span<const Point> points,
                                                  const Parallel& parallel) const {
    std::vector<double> depth(points.size());
    parallel.for_each(points.size(), kChunk, [&](std::size_t i) { depth[i] = signed_depth(points[i]); });
    return depth;
}

bool SurfaceQueries::crosses_surface(const Point& from, const Point& to) const {
    bool crosses = false;
    tree_.visit_line(from, to - from, 0, 1, [&](Index, double, bool) { crosses = true; });
    return crosses;
}

bool SurfaceQueries::leaves_inside(const Point& from, const Point& to, double contact) const {
    std::vector<double> crossing;
    tree_.visit_line(from, to - from, 0, 1, [&](Index, double t, bool) { crossing.push_back(t); });
    std::sort(crossing.begin(), crossing.end());
    const double least = contact / glm::length(to - from);
    for (std::size_t i = 0; i + 1 < crossing.size(); ++i) {
        if (!(crossing[i + 1] - crossing[i] > least)) continue;
        const double t = 0.5 * (crossing[i] + crossing[i + 1]);
        if (!is_inside(from + t * (to - from))) return true;
    }
    return false;
}

bool SurfaceQueries::is_inside_beyond(const Point& p, const Projection& at, double contact) const {
    const Point across = at.point - p;
    const double distance = glm::length(across);
    const auto inside_towards = [&](const Point& way) { return is_inside(at.point + contact * way); };
    if (distance >= 1e-3 * contact) return inside_towards(across / distance);
    // What is left of a point on the surface has no direction but that of rounding; and along the normal of
    // one side of an edge lies, as likely as not, the other side itself.
    const Point& up = at.direction;
    const Point u = glm::normalize(glm::cross(up, std::abs(up.x) < 0.7 ? Point(1, 0, 0) : Point(0, 1, 0)));
    const Point v = glm::cross(up, u);
    const std::array<Point, 4> tilted = {up + 0.3 * u, up - 0.2 * u, up + 0.25 * v, up - 0.35 * v};
    return std::all_of(tilted.begin(), tilted.end(), inside_towards);
}

} // namespace hexopt
