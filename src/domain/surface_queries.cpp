#include "domain/surface_queries.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 256;

std::vector<TriangleTree::Corners> corners_of(const BoundaryModel& model) {
    std::vector<TriangleTree::Corners> corners;
    corners.reserve(model.triangle_count());
    for (Index t = 0; t < model.triangle_count(); ++t) corners.push_back(model.triangle(t));
    return corners;
}

} // namespace

SurfaceQueries::SurfaceQueries(const BoundaryModel& model) : model_(model), tree_(corners_of(model)) {}

double SurfaceQueries::winding_number(const Point& p) const {
    // Dipoles err by a few per cent at beta = 2: whoever is near the threshold is asked again.
    double winding = tree_.winding_number(p, 2);
    if (std::abs(winding - 0.5) < 0.3) winding = tree_.winding_number(p, 5);
    if (std::abs(winding - 0.5) < 0.05)
        winding = tree_.winding_number(p, std::numeric_limits<double>::infinity());
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
    tree_.visit_line(from, to - from, 0, 1, [&](Index, double) { crosses = true; });
    return crosses;
}

bool SurfaceQueries::leaves_inside(const Point& from, const Point& to) const {
    std::vector<double> crossing;
    tree_.visit_line(from, to - from, 0, 1, [&](Index, double t) { crossing.push_back(t); });
    std::sort(crossing.begin(), crossing.end());
    for (std::size_t i = 0; i + 1 < crossing.size(); ++i) {
        if (crossing[i + 1] - crossing[i] < 1e-9) continue;
        const double t = 0.5 * (crossing[i] + crossing[i + 1]);
        if (!is_inside(from + t * (to - from))) return true;
    }
    return false;
}

bool SurfaceQueries::is_side_changed(const Point& p, const Projection& at) const {
    const Point across = at.point - p;
    const double step = 1e-6 * model_.diagonal();
    const double distance = glm::length(across);
    const Point beyond = distance > 0 ? across / distance : at.direction;
    return is_inside(p) != is_inside(at.point + step * beyond);
}

} // namespace hexopt
