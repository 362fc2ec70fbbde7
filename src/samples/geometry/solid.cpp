#include "samples/geometry/solid.hpp"

#include "domain/triangulate_region.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>

namespace hexopt::geometry {

namespace {

/// Adds triangles to a solid under the names of their patches.
class Painter {
  public:
    explicit Painter(Solid& solid) : solid_(solid) {}
    void triangle(Index a, Index b, Index c, const std::string& name) {
        if (a == b || b == c || c == a) return; // at a pole
        const auto [entry, is_new] = patch_.try_emplace(name, static_cast<Index>(solid_.patch_names.size()));
        if (is_new) solid_.patch_names.push_back(name);
        solid_.triangles.push_back({a, b, c});
        solid_.patch.push_back(entry->second);
    }
    /// Cut along the shorter diagonal; the one from a where both are equal.
    void quad(Index a, Index b, Index c, Index d, const std::string& name) {
        const auto& x = solid_.vertices;
        if (glm::distance(x[a], x[c]) <= glm::distance(x[b], x[d]) * (1 + 1e-12)) {
            triangle(a, b, c, name);
            triangle(a, c, d, name);
        } else {
            triangle(a, b, d, name);
            triangle(b, c, d, name);
        }
    }

  private:
    Solid& solid_;
    std::map<std::string, Index> patch_;
};

const std::string& name_at(const std::vector<std::string>& names, std::size_t i) {
    return names.size() == 1 ? names.front() : names[i];
}

void turn_outward(Solid& solid) {
    if (signed_volume(solid) >= 0) return;
    for (auto& t : solid.triangles) std::swap(t[1], t[2]);
}

/// Coordinates in a plane with this normal.
std::vector<Point2> flatten(const std::vector<Point>& points, const Point& normal) {
    const Point n = glm::normalize(normal);
    const Point other = std::abs(n.x) < 0.6 ? Point(1, 0, 0) : Point(0, 1, 0);
    const Point u = glm::normalize(glm::cross(other, n)), v = glm::cross(n, u);
    std::vector<Point2> flat;
    for (const Point& p : points) flat.emplace_back(glm::dot(p - points[0], u), glm::dot(p - points[0], v));
    return flat;
}

/// Twice the area of a closed polygon as a vector along its normal.
Point area_vector(const std::vector<Point>& points) {
    Point sum(0);
    for (std::size_t i = 0; i < points.size(); ++i)
        sum += glm::cross(points[i] - points[0], points[(i + 1) % points.size()] - points[0]);
    return sum;
}

} // namespace

double signed_volume(const Solid& solid) {
    double six = 0;
    const Point origin = solid.vertices.empty() ? Point(0) : solid.vertices.front();
    for (const auto& t : solid.triangles)
        six += glm::dot(solid.vertices[t[0]] - origin,
                        glm::cross(solid.vertices[t[1]] - origin, solid.vertices[t[2]] - origin));
    return six / 6;
}

Result<Solid> extrude(const Extrusion& shape) {
    std::vector<std::vector<Point2>> outlines = {shape.outer.points};
    for (const Loop& hole : shape.holes) outlines.push_back(hole.points);
    const auto filling = triangulate_region(outlines);
    if (!filling) return filling.error();

    Solid solid;
    std::vector<const Loop*> loops = {&shape.outer};
    for (const Loop& hole : shape.holes) loops.push_back(&hole);
    for (double z : {shape.low, shape.high})
        for (const Loop* loop : loops)
            for (const Point2& p : loop->points) solid.vertices.emplace_back(p, z);
    const Index above = static_cast<Index>(solid.vertices.size() / 2);

    Painter paint(solid);
    Index first = 0;
    for (const Loop* loop : loops) {
        const Index count = static_cast<Index>(loop->points.size());
        const bool has_inside_left = (twice_area(loop->points) > 0) == (loop == &shape.outer);
        for (Index i = 0; i < count; ++i) {
            Index a = first + i, b = first + (i + 1) % count;
            if (!has_inside_left) std::swap(a, b);
            paint.quad(a, b, b + above, a + above, name_at(loop->names, i));
        }
        first += count;
    }
    for (const auto& t : *filling) paint.triangle(t[0], t[2], t[1], shape.low_name);
    for (const auto& t : *filling) paint.triangle(t[0] + above, t[1] + above, t[2] + above, shape.high_name);
    return solid;
}

Solid make_box(const Point& low, const Point& high, const std::array<std::string, 6>& names) {
    Solid box;
    for (int i = 0; i < 8; ++i)
        box.vertices.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
    constexpr Index kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    Painter paint(box);
    for (std::size_t f = 0; f < 6; ++f)
        paint.quad(kFaces[f][0], kFaces[f][1], kFaces[f][2], kFaces[f][3], names[f]);
    return box;
}

Solid revolve(const Profile& profile, int segments) {
    Solid solid;
    std::vector<std::vector<Index>> rings;
    for (const Point2& p : profile.points) {
        std::vector<Index> ring;
        for (int s = 0; s < segments; ++s) {
            if (s > 0 && p.y == 0) {
                ring.push_back(ring.front());
                continue;
            }
            const double angle = 2 * std::numbers::pi * s / segments;
            ring.push_back(static_cast<Index>(solid.vertices.size()));
            solid.vertices.emplace_back(p.x, p.y * std::cos(angle), p.y * std::sin(angle));
        }
        rings.push_back(std::move(ring));
    }
    Painter paint(solid);
    for (std::size_t i = 0; i + 1 < rings.size(); ++i)
        for (std::size_t s = 0; s < rings[i].size(); ++s) {
            const std::size_t next = (s + 1) % rings[i].size();
            paint.quad(rings[i][s], rings[i + 1][s], rings[i + 1][next], rings[i][next],
                       name_at(profile.names, i));
        }
    turn_outward(solid);
    return solid;
}

Result<Solid> loft(const Loft& shape) {
    Solid solid;
    for (const auto& section : shape.sections)
        solid.vertices.insert(solid.vertices.end(), section.begin(), section.end());
    const Index count = static_cast<Index>(shape.sections.front().size());
    Painter paint(solid);
    for (Index s = 0; s + 1 < shape.sections.size(); ++s)
        for (Index i = 0; i < count; ++i) {
            const Index a = s * count + i, b = s * count + (i + 1) % count;
            paint.quad(a, b, b + count, a + count, name_at(shape.names, i));
        }
    const Index last = static_cast<Index>(shape.sections.size() - 1) * count;
    for (const bool is_first : {true, false}) {
        const std::vector<Point>& section = is_first ? shape.sections.front() : shape.sections.back();
        const auto filling = triangulate_region({flatten(section, area_vector(section))});
        if (!filling) return filling.error();
        for (const auto& t : *filling)
            is_first ? paint.triangle(t[0], t[2], t[1], shape.first_name)
                     : paint.triangle(t[0] + last, t[1] + last, t[2] + last, shape.last_name);
    }
    turn_outward(solid);
    return solid;
}

Solid transformed(Solid solid, const glm::dmat4& map) {
    for (Point& p : solid.vertices) p = Point(map * glm::dvec4(p, 1));
    turn_outward(solid);
    return solid;
}

} // namespace hexopt::geometry
