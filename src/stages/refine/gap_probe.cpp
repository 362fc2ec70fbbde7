#include "stages/refine/gap_probe.hpp"

#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kFacing = 0.866; ///< cosine of 30 degrees

/// Where a ray meets a triangle, as a distance along it; infinity if it does not. Source: Moeller and
/// Trumbore 1997.
double ray_distance(const Point& from, const Point& direction, const Point& origin, const Point& edge1,
                    const Point& edge2) {
    constexpr double kMissed = std::numeric_limits<double>::infinity(), kEdge = 1e-9;
    const Point p = glm::cross(direction, edge2);
    const double det = glm::dot(edge1, p);
    if (det == 0) return kMissed;
    const Point t = from - origin;
    const double u = glm::dot(t, p) / det;
    if (!(u >= -kEdge && u <= 1 + kEdge)) return kMissed;
    const Point q = glm::cross(t, edge1);
    const double v = glm::dot(direction, q) / det;
    if (!(v >= -kEdge && u + v <= 1 + kEdge)) return kMissed;
    return glm::dot(edge2, q) / det;
}

} // namespace

GapProbe::GapProbe(const Domain& domain) {
    const auto count = static_cast<Index>(domain.model.triangle_count());
    std::vector<Box> boxes(count);
    Box frame;
    for (Index t = 0; t < count; ++t) {
        for (const Point& p : domain.model.triangle(t)) boxes[t].add(p);
        frame.add(boxes[t]);
    }
    tree_ = BoxTree(frame);
    std::vector<Index> order;
    root_ = tree_.add_tree(boxes, 0, order);
    for (Index t : order) {
        const auto& x = domain.model.triangle(t);
        const Point cross = glm::cross(x[1] - x[0], x[2] - x[0]);
        const double length = glm::length(cross);
        triangles_.push_back({x[0], x[1] - x[0], x[2] - x[0], length > 0 ? cross / length : Point(0)});
    }
    nearest_ = 1e-9 * domain.model.diagonal();
}

double GapProbe::distance(const Point& from, const Point& direction, const Point& normal,
                          double reach) const {
    double found = reach;
    const double best2 = 0.25 * reach * reach;
    tree_.visit_near(root_, from + 0.5 * reach * direction, best2, [&](Index first, Index last) {
        for (Index t = first; t < last; ++t) {
            const Triangle& triangle = triangles_[t];
            if (glm::dot(triangle.normal, normal) > -kFacing) continue;
            const double at = ray_distance(from, direction, triangle.origin, triangle.edge1, triangle.edge2);
            if (at > nearest_ && at < found) found = at;
        }
    });
    return found;
}

} // namespace hexopt
