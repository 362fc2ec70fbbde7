#include "domain/turn_beside.hpp"

#include "domain/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hexopt {

namespace {

TurnBeside::Edge edge_of(const std::array<Index, 3>& triangle, std::size_t k) {
    const Index a = triangle[k], b = triangle[(k + 1) % 3];
    return {std::min(a, b), std::max(a, b)};
}

} // namespace

TurnBeside::TurnBeside(const CleanSurface& surface, const std::set<Edge>& lines)
    : surface_(surface), lines_(lines) {
    for (Index t = 0; t < surface_.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) beside_[edge_of(surface_.triangles[t], k)].push_back(t);
}

std::array<double, 2> TurnBeside::turn_deg(const Edge& edge, const Point& p, double reach) const {
    const auto found = beside_.find(edge);
    if (found == beside_.end() || found->second.size() != 2) return {0, 0};
    const auto [left, right] = std::tuple(found->second[0], found->second[1]);
    const Point sum = surface_.polygons.normal[left] + surface_.polygons.normal[right];
    const double length = glm::length(sum);
    if (!(length > 0)) return {0, 0};
    return {walk(left, sum / length, p, reach), walk(right, sum / length, p, reach)};
}

double TurnBeside::walk(Index triangle, const Point& normal, const Point& p, double reach) const {
    double least = 1;
    std::set<Index> seen = {triangle};
    std::vector<Index> open = {triangle};
    while (!open.empty()) {
        const Index t = open.back();
        open.pop_back();
        least = std::min(least, glm::dot(surface_.polygons.normal[t], normal));
        for (std::size_t k = 0; k < 3; ++k) {
            const Edge edge = edge_of(surface_.triangles[t], k);
            if (lines_.contains(edge)) continue;
            for (const Index next : beside_.at(edge))
                if (!seen.contains(next) && distance(next, p) <= reach) {
                    seen.insert(next);
                    open.push_back(next);
                }
        }
    }
    return std::acos(std::clamp(least, -1.0, 1.0)) * 180 / std::numbers::pi;
}

double TurnBeside::distance(Index triangle, const Point& p) const {
    const auto& [a, b, c] = surface_.triangles[triangle];
    const std::vector<Point>& v = surface_.vertices;
    return glm::distance(p, closest_on_triangle(p, v[a], v[b], v[c]).point);
}

} // namespace hexopt
