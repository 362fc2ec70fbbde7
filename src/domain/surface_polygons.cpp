#include "domain/surface_polygons.hpp"

#include "domain/box_tree.hpp"

#include <algorithm>
#include <cmath>
#include <compare>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

Error bad_surface(std::string where, std::string reason) {
    return make_error(ErrorCode::bad_input, "surface", std::move(where), std::move(reason));
}

/// Unit normal, zero where rounding leaves none.
Point normal_of(const Point& a, const Point& b, const Point& c) {
    const Point n = glm::cross(b - a, c - a);
    const double longest2 =
        std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
    const double length = glm::length(n);
    return length > 1e-12 * longest2 ? n / length : Point(0);
}

struct EdgeUse {
    std::array<Index, 2> edge; ///< smaller vertex first
    Index triangle;
    auto operator<=>(const EdgeUse&) const = default;
};

std::array<Index, 2> edge_of(const std::array<Index, 3>& triangle, int k) {
    const auto [low, high] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
    return {low, high};
}

std::vector<EdgeUse> collect_edges(const CleanSurface& surface) {
    std::vector<EdgeUse> uses;
    uses.reserve(3 * surface.triangles.size());
    for (Index t = 0; t < surface.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) uses.push_back({edge_of(surface.triangles[t], k), t});
    std::sort(uses.begin(), uses.end());
    return uses;
}

void count_irregular_edges(const std::vector<EdgeUse>& uses, CleanSurface& surface) {
    for (std::size_t i = 0; i < uses.size();) {
        std::size_t end = i + 1;
        while (end < uses.size() && uses[end].edge == uses[i].edge) ++end;
        if (end - i == 1) ++surface.open_edges;
        if (end - i > 2) ++surface.nonmanifold_edges;
        i = end;
    }
}

/// The neighbour's normal, as seen from a triangle that may run the other way round, or zero.
Point normal_across(const CleanSurface& surface, const std::vector<EdgeUse>& uses, Index triangle, int k) {
    const auto& own = surface.triangles[triangle];
    const std::array<Index, 2> edge = edge_of(own, k);
    const auto first = std::lower_bound(uses.begin(), uses.end(), EdgeUse{edge, 0});
    for (auto use = first; use != uses.end() && use->edge == edge; ++use) {
        const Point normal = surface.polygons.normal[use->triangle];
        if (use->triangle == triangle || normal == Point(0)) continue;
        const auto& other = surface.triangles[use->triangle];
        for (int j = 0; j < 3; ++j)
            if (other[j] == own[k] && other[(j + 1) % 3] == own[(k + 1) % 3]) return -normal;
        return normal;
    }
    return Point(0);
}

/// A triangle whose vertices lie on a line closes the gap between its neighbours: it takes the normal of the
/// one beside its longest edge, so that a crease shows between it and the others.
void lend_normals(const std::vector<EdgeUse>& uses, CleanSurface& surface) {
    std::vector<Index> without;
    for (Index t = 0; t < surface.triangles.size(); ++t)
        if (surface.polygons.normal[t] == Point(0)) without.push_back(t);
    for (bool lent = true; lent && !without.empty();) {
        lent = false;
        std::vector<Index> still;
        for (Index t : without) {
            const auto length = [&](int k) {
                const auto edge = edge_of(surface.triangles[t], k);
                return glm::length(surface.vertices[edge[0]] - surface.vertices[edge[1]]);
            };
            std::array<int, 3> order = {0, 1, 2};
            std::sort(order.begin(), order.end(),
                      [&](int i, int j) { return length(i) != length(j) ? length(i) > length(j) : i < j; });
            Point normal(0);
            for (int k : order)
                if (normal == Point(0)) normal = normal_across(surface, uses, t, k);
            if (normal == Point(0)) still.push_back(t);
            lent = lent || normal != Point(0);
            surface.polygons.normal[t] = normal;
        }
        without = std::move(still);
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

Status check_soup(const TriangleSoup& soup) {
    if (!soup.patch.empty() && soup.patch.size() != soup.triangles.size())
        return bad_surface(
            "", fmt::format("{} patch numbers for {} triangles", soup.patch.size(), soup.triangles.size()));
    if (!soup.patch_group.empty() && soup.patch_group.size() != soup.patch_names.size())
        return bad_surface("", fmt::format("groups of {} patches, names of {}", soup.patch_group.size(),
                                           soup.patch_names.size()));
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

double compute_diagonal(const TriangleSoup& soup) {
    Box box;
    for (const Point& p : soup.vertices) box.add(p);
    return soup.vertices.empty() ? 0 : glm::distance(box.low, box.high);
}

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

std::vector<std::array<Index, 2>> merge_edges(const std::vector<Point>& vertices,
                                              std::span<const std::array<Index, 2>> edges) {
    std::vector<std::array<Index, 2>> merged;
    if (edges.empty()) return merged;
    const std::vector<Index> first = find_first_equal(vertices);
    for (const auto& [a, b] : edges)
        merged.push_back({std::min(first[a], first[b]), std::max(first[a], first[b])});
    std::sort(merged.begin(), merged.end());
    return merged;
}

Result<CleanSurface> clean_surface(const TriangleSoup& soup) {
    if (Status ok = check_soup(soup); !ok) return ok.error();
    CleanSurface surface;
    surface.vertices = soup.vertices;
    const std::vector<Index> first = find_first_equal(soup.vertices);
    std::vector<std::array<Index, 3>> merged = soup.triangles;
    for (auto& t : merged)
        for (Index& v : t) v = first[v];
    const std::vector<std::uint8_t> repeated = find_repeated(merged);
    bool area = false;
    for (Index t = 0; t < merged.size(); ++t) {
        const auto& v = merged[t];
        if (repeated[t] || v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
            ++surface.dropped_triangles;
            continue;
        }
        surface.triangles.push_back(v);
        surface.source.push_back(t);
        surface.polygons.normal.push_back(
            normal_of(soup.vertices[v[0]], soup.vertices[v[1]], soup.vertices[v[2]]));
        area = area || surface.polygons.normal.back() != Point(0);
        surface.polygons.patch.push_back(soup.patch.empty() ? 0 : soup.group_of(soup.patch[t]));
        surface.polygons.vertex.item.insert(surface.polygons.vertex.item.end(), v.begin(), v.end());
        surface.polygons.vertex.offset.push_back(surface.polygons.vertex.item.size());
    }
    if (!area)
        return bad_surface("", fmt::format("no triangle with an area among {}", soup.triangles.size()));
    const std::vector<EdgeUse> uses = collect_edges(surface);
    count_irregular_edges(uses, surface);
    lend_normals(uses, surface);
    return surface;
}

} // namespace hexopt
