#pragma once

#include "core/random.hpp"
#include "mesh/triangle_soup.hpp"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numbers>

namespace hexopt {

/// Triangles of a grid of n by m quads whose vertex (i, j) is at(i, j), counter-clockwise seen from the side
/// that i x j points to. Vertices repeat, as in STL files.
template <class At>
void add_grid(TriangleSoup& soup, int n, int m, const At& at) {
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const std::array<Point, 4> p = {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
            for (const auto& t : {std::array<int, 3>{0, 1, 2}, std::array<int, 3>{0, 2, 3}}) {
                const auto first = static_cast<Index>(soup.vertices.size());
                for (int k : t) soup.vertices.push_back(p[static_cast<std::size_t>(k)]);
                soup.triangles.push_back({first, first + 1, first + 2});
            }
        }
}

inline TriangleSoup make_box_surface(const Point& low, const Point& high, int n = 4) {
    TriangleSoup soup;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            add_grid(soup, n, n, [&](int i, int j) {
                if (side == 0) std::swap(i, j);
                Point p;
                p[axis] = side ? high[axis] : low[axis];
                const int a = (axis + 1) % 3, b = (axis + 2) % 3;
                p[a] = low[a] + (high[a] - low[a]) * i / n;
                p[b] = low[b] + (high[b] - low[b]) * j / n;
                return p;
            });
    return soup;
}

/// A cube's surface blown up: vertices on the sphere.
inline TriangleSoup make_sphere_surface(const Point& centre, double radius, int n = 24) {
    TriangleSoup soup = make_box_surface(Point(-1), Point(1), n);
    for (Point& p : soup.vertices) p = centre + radius * glm::normalize(p);
    return soup;
}

/// Round the z axis.
inline TriangleSoup make_torus_surface(double large, double small, int n = 48, int m = 24) {
    TriangleSoup soup;
    add_grid(soup, n, m, [&](int i, int j) {
        const double u = 2 * std::numbers::pi * (i % n) / n, v = 2 * std::numbers::pi * (j % m) / m;
        const double r = large + small * std::cos(v);
        return Point(r * std::cos(u), r * std::sin(u), small * std::sin(v));
    });
    return soup;
}

inline void append_soup(TriangleSoup& soup, const TriangleSoup& other) {
    const auto first = static_cast<Index>(soup.vertices.size());
    soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
    for (auto t : other.triangles) soup.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

/// Rotation drawn uniformly enough for tests, by a random quaternion.
inline glm::dmat3 random_rotation(Random& random) {
    std::array<double, 4> q;
    double length = 0;
    for (double& x : q) x = random.uniform(-1, 1), length += x * x;
    for (double& x : q) x /= std::sqrt(length);
    const auto [w, x, y, z] = q;
    return glm::dmat3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), //
                      2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), //
                      2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
}

} // namespace hexopt
