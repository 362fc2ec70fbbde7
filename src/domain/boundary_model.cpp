#include "domain/boundary_model.hpp"

#include "domain/closest_point.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace hexopt {

namespace {

double squared(double x) { return x * x; }

Point unit_or(const Point& v, const Point& otherwise) {
    const double length = glm::length(v);
    return length > 0 ? v / length : otherwise;
}

double angle_between(const Point& a, const Point& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// The closest of many: the nearest, and of equally near ones the first, so that the order of visits is
/// immaterial.
template <std::size_t N>
struct Nearest {
    double distance2;
    Index element;
    ClosestPoint<N> at;

    void offer(const Point& query, Index candidate, const ClosestPoint<N>& closest) {
        const Point r = query - closest.point;
        const double d2 = glm::dot(r, r);
        if (d2 > distance2 || (d2 == distance2 && candidate >= element)) return;
        *this = {d2, candidate, closest};
    }
};

Point any_perpendicular(const Point& unit) {
    int least = 0;
    for (int k = 1; k < 3; ++k)
        if (std::abs(unit[k]) < std::abs(unit[least])) least = k;
    Point axis(0);
    axis[least] = 1;
    return glm::normalize(glm::cross(unit, axis));
}

} // namespace

Projection BoundaryModel::project_patch(Index patch, const Point& query, Index hint) const {
    const bool all = patch == kNoIndex;
    const std::array<Index, 2> range =
        all ? std::array<Index, 2>{0, static_cast<Index>(triangles_.size())} : patches_[patch].element;
    const Index start = hint >= range[0] && hint < range[1] ? hint : range[0];
    auto closest = [&](Index t) {
        const auto& x = triangles_[t].corner;
        return closest_on_triangle(query, x[0], x[1], x[2]);
    };
    Nearest<3> best{0, start, closest(start)};
    best.distance2 = glm::dot(query - best.at.point, query - best.at.point);
    // The plane of a triangle passes its corners only up to rounding.
    const double rounding2 = squared(1e-14 * diagonal_);
    triangle_tree_.visit_near(
        all ? all_triangles_ : patches_[patch].root, query, best.distance2, [&](Index first, Index last) {
            for (Index t = first; t < last; ++t) {
                const double height = glm::dot(query - triangles_[t].corner[0], triangles_[t].normal);
                if (height * height * (1 - 1e-9) > best.distance2 + rounding2) continue;
                best.offer(query, t, closest(t));
            }
        });
    Projection result;
    result.point = best.at.point;
    result.element = best.element;
    result.distance = std::sqrt(best.distance2);
    result.direction = triangles_[best.element].normal;
    result.smooth_direction = result.direction;
    if (triangle_vertex_normal_.empty()) return result;
    const auto& normal = triangle_vertex_normal_[best.element];
    const auto& w = best.at.weight;
    result.smooth_direction =
        unit_or(w[0] * normal[0] + w[1] * normal[1] + w[2] * normal[2], result.direction);
    return result;
}

Projection BoundaryModel::project_curve(Index curve, const Point& query, Index hint) const {
    const bool all = curve == kNoIndex;
    assert(!segments_.empty());
    const std::array<Index, 2> range =
        all ? std::array<Index, 2>{0, static_cast<Index>(segments_.size())} : curves_[curve].element;
    const Index start = hint >= range[0] && hint < range[1] ? hint : range[0];
    auto closest = [&](Index s) {
        return closest_on_segment(query, segments_[s].end[0], segments_[s].end[1]);
    };
    Nearest<2> best{0, start, closest(start)};
    best.distance2 = glm::dot(query - best.at.point, query - best.at.point);
    segment_tree_.visit_near(all ? all_segments_ : curves_[curve].root, query, best.distance2,
                             [&](Index first, Index last) {
                                 for (Index s = first; s < last; ++s) best.offer(query, s, closest(s));
                             });
    Projection result;
    result.point = best.at.point;
    result.element = best.element;
    result.distance = std::sqrt(best.distance2);
    result.direction = segments_[best.element].tangent;
    const auto& tangent = segment_vertex_tangent_[best.element];
    result.smooth_direction =
        unit_or(best.at.weight[0] * tangent[0] + best.at.weight[1] * tangent[1], result.direction);
    return result;
}

Projection BoundaryModel::project(Association bound_to, const Point& query, Index hint) const {
    switch (bound_to.kind) {
    case EntityKind::patch:
        return project_patch(bound_to.entity, query, hint);
    case EntityKind::curve:
        return project_curve(bound_to.entity, query, hint);
    case EntityKind::corner: {
        Projection result;
        result.point = corners_[bound_to.entity];
        result.distance = glm::length(query - result.point);
        return result;
    }
    case EntityKind::interior:
    case EntityKind::hanging:
        break;
    }
    Projection result;
    result.point = query;
    return result;
}

LocalFrame BoundaryModel::local_frame(Association bound_to, const Projection& at) const {
    LocalFrame frame{{Point(1, 0, 0), Point(0, 1, 0), Point(0, 0, 1)}, 0};
    if (bound_to.kind == EntityKind::interior) frame.freedom = 3;
    if (bound_to.kind != EntityKind::patch && bound_to.kind != EntityKind::curve) return frame;
    const Point main = at.smooth_direction;
    if (main == Point(0)) return frame;
    const Point u = any_perpendicular(main), v = glm::cross(main, u);
    if (bound_to.kind == EntityKind::patch) return {{u, v, main}, 2};
    return {{main, u, v}, 1};
}

namespace {

/// Largest angle between two of the directions, by two sweeps.
double spread(const std::vector<Point>& directions, const Point& reference) {
    double widest = 0;
    Point from = reference;
    for (int sweep = 0; sweep < 2; ++sweep) {
        Point farthest = from;
        double largest = 0;
        for (const Point& d : directions) {
            const double angle = angle_between(from, d);
            if (angle > largest) largest = angle, farthest = d;
        }
        widest = std::max(widest, largest);
        from = farthest;
    }
    return widest;
}

} // namespace

double BoundaryModel::normal_spread(Association bound_to, const Point& query, double radius) const {
    const bool on_patch = bound_to.kind == EntityKind::patch;
    if (!on_patch && bound_to.kind != EntityKind::curve) return 0;
    const Projection nearest = project(bound_to, query);
    const double radius2 = std::max(squared(radius), squared(nearest.distance));
    std::vector<Point> near;
    auto keep = [&](const Point& direction, const Point& closest) {
        if (direction != Point(0) && glm::dot(query - closest, query - closest) <= radius2)
            near.push_back(direction);
    };
    if (on_patch)
        triangle_tree_.visit_near(
            patches_[bound_to.entity].root, query, radius2, [&](Index first, Index last) {
                for (Index t = first; t < last; ++t) {
                    const auto& x = triangles_[t].corner;
                    keep(triangles_[t].normal, closest_on_triangle(query, x[0], x[1], x[2]).point);
                }
            });
    else
        segment_tree_.visit_near(curves_[bound_to.entity].root, query, radius2, [&](Index first, Index last) {
            for (Index s = first; s < last; ++s)
                keep(segments_[s].tangent,
                     closest_on_segment(query, segments_[s].end[0], segments_[s].end[1]).point);
        });
    return spread(near, nearest.direction);
}

double BoundaryModel::quad_deviation(std::span<const Point, 4> x, Index patch, Index& hint) const {
    const Projection centre = project_patch(patch, quad_centre({x[0], x[1], x[2], x[3]}), hint);
    hint = centre.element;
    double largest = centre.distance;
    for (int k = 0; k < 4; ++k) {
        largest = std::max(largest, project_patch(patch, x[k], hint).distance);
        largest = std::max(largest, project_patch(patch, 0.5 * (x[k] + x[(k + 1) % 4]), hint).distance);
    }
    return largest;
}

} // namespace hexopt
