#include "domain/closest_point.hpp"

namespace hexopt {

namespace {

double distance2(const Point& a, const Point& b) { return glm::dot(a - b, a - b); }

ClosestPoint<3> closest_on_edges(const Point& p, const std::array<Point, 3>& x) {
    ClosestPoint<3> best{x[0], {1, 0, 0}};
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3;
        const ClosestPoint<2> edge = closest_on_segment(p, x[k], x[next]);
        if (distance2(p, edge.point) >= distance2(p, best.point)) continue;
        best.point = edge.point;
        best.weight = {0, 0, 0};
        best.weight[k] = edge.weight[0];
        best.weight[next] = edge.weight[1];
    }
    return best;
}

} // namespace

ClosestPoint<3> closest_on_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
    const Point ab = b - a, ac = c - a, ap = p - a;
    const double ab_ap = glm::dot(ab, ap), ac_ap = glm::dot(ac, ap);
    if (ab_ap <= 0 && ac_ap <= 0) return {a, {1, 0, 0}};
    const Point bp = p - b;
    const double ab_bp = glm::dot(ab, bp), ac_bp = glm::dot(ac, bp);
    if (ab_bp >= 0 && ac_bp <= ab_bp) return {b, {0, 1, 0}};
    const Point cp = p - c;
    const double ab_cp = glm::dot(ab, cp), ac_cp = glm::dot(ac, cp);
    if (ac_cp >= 0 && ab_cp <= ac_cp) return {c, {0, 0, 1}};
    const double wa = ab_bp * ac_cp - ab_cp * ac_bp;
    const double wb = ab_cp * ac_ap - ab_ap * ac_cp;
    const double wc = ab_ap * ac_bp - ab_bp * ac_ap;
    // Inside, all three weights are positive; elsewhere, and for triangles without area, an edge is closest.
    if (!(wa > 0 && wb > 0 && wc > 0)) return closest_on_edges(p, {a, b, c});
    const double scale = 1 / (wa + wb + wc);
    const double v = wb * scale, w = wc * scale;
    return {a + v * ab + w * ac, {1 - v - w, v, w}};
}

} // namespace hexopt
