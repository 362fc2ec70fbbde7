#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

Error bad_surface(std::string where, std::string reason) {
    return make_error(ErrorCode::bad_input, "surface", std::move(where), std::move(reason));
}

Status check_soup(const TriangleSoup& soup) {
    if (!soup.patch.empty() && soup.patch.size() != soup.triangles.size())
        return bad_surface(
            "", fmt::format("{} patch numbers for {} triangles", soup.patch.size(), soup.triangles.size()));
    for (std::size_t t = 0; t < soup.triangles.size(); ++t)
        for (Index v : soup.triangles[t]) {
            if (v >= soup.vertices.size())
                return bad_surface(fmt::format("triangle {}", t),
                                   fmt::format("vertex {} of {} does not exist", v, soup.vertices.size()));
            const Point& x = soup.vertices[v];
            if (!std::isfinite(x.x) || !std::isfinite(x.y) || !std::isfinite(x.z))
                return bad_surface(fmt::format("vertex {}", v), "a coordinate is not finite");
        }
    return Done{};
}

/// For every vertex the first one at exactly the same place.
std::vector<Index> find_first_equal(const std::vector<Point>& x) {
    std::vector<Index> order(x.size()), first(x.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
        for (int k = 0; k < 3; ++k)
            if (x[a][k] != x[b][k]) return x[a][k] < x[b][k];
        return a < b;
    });
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && x[order[i]] == x[order[i - 1]] ? first[order[i - 1]] : order[i];
    return first;
}

/// Unit normal, zero where rounding leaves none.
Point normal_of(const Point& a, const Point& b, const Point& c) {
    const Point n = glm::cross(b - a, c - a);
    const double longest2 =
        std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
    const double length = glm::length(n);
    return length > 1e-12 * longest2 ? n / length : Point(0);
}

void count_irregular_edges(CleanSurface& surface) {
    std::vector<std::array<Index, 2>> edges;
    for (const auto& t : surface.triangles)
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
            edges.push_back({low, high});
        }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i + 1;
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        if (end - i == 1) ++surface.open_edges;
        if (end - i > 2) ++surface.nonmanifold_edges;
        i = end;
    }
}

/// Per triangle: 1 where an earlier one has the same vertices.
std::vector<std::uint8_t> find_repeated(const std::vector<std::array<Index, 3>>& triangles) {
    auto key = [&](Index t) {
        std::array<Index, 3> sorted = triangles[t];
        std::sort(sorted.begin(), sorted.end());
        return sorted;
    };
    std::vector<Index> order(triangles.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
        const auto ka = key(a), kb = key(b);
        return ka != kb ? ka < kb : a < b;
    });
    std::vector<std::uint8_t> repeated(triangles.size(), 0);
    for (std::size_t i = 1; i < order.size(); ++i) repeated[order[i]] = key(order[i]) == key(order[i - 1]);
    return repeated;
}

} // namespace

Result<CleanSurface> clean_surface(const TriangleSoup& soup) {
    if (Status ok = check_soup(soup); !ok) return ok.error();
    CleanSurface surface;
    surface.vertices = soup.vertices;
    const std::vector<Index> first = find_first_equal(soup.vertices);
    std::vector<std::array<Index, 3>> merged = soup.triangles;
    for (auto& t : merged)
        for (Index& v : t) v = first[v];
    const std::vector<std::uint8_t> repeated = find_repeated(merged);
    for (Index t = 0; t < merged.size(); ++t) {
        const auto& v = merged[t];
        const Point normal = normal_of(soup.vertices[v[0]], soup.vertices[v[1]], soup.vertices[v[2]]);
        if (repeated[t] || normal == Point(0)) {
            ++surface.dropped_triangles;
            continue;
        }
        surface.triangles.push_back(v);
        surface.source.push_back(t);
        surface.polygons.normal.push_back(normal);
        surface.polygons.patch.push_back(soup.patch.empty() ? 0 : soup.patch[t]);
        surface.polygons.vertex.item.insert(surface.polygons.vertex.item.end(), v.begin(), v.end());
        surface.polygons.vertex.offset.push_back(surface.polygons.vertex.item.size());
    }
    if (surface.triangles.empty())
        return bad_surface("", fmt::format("no triangle with an area among {}", soup.triangles.size()));
    count_irregular_edges(surface);
    return surface;
}

} // namespace hexopt
