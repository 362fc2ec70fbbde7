#pragma once

#include "domain/domain.hpp"
#include "mesh/hex_reference.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace hexopt::test {

inline void append_quad(TriangleSoup& soup, std::array<Point, 4> x, Index patch) {
    const Index first = static_cast<Index>(soup.vertices.size());
    soup.vertices.insert(soup.vertices.end(), x.begin(), x.end());
    soup.triangles.push_back({first, first + 1, first + 2});
    soup.triangles.push_back({first, first + 2, first + 3});
    soup.patch.push_back(patch);
    soup.patch.push_back(patch);
}

/// Box as twelve triangles in six patches "x0", "x1", "y0" ... (a later box: "x0_inner"); normals outwards,
/// or inwards where `inside_out`.
inline void append_box(TriangleSoup& soup, const Point& low, const Point& high, bool inside_out = false) {
    const Index first = static_cast<Index>(soup.patch_names.size());
    const char* suffix = first == 0 ? "" : "_inner";
    for (const char* name : {"x0", "x1", "y0", "y1", "z0", "z1"}) {
        soup.patch_names.emplace_back(name);
        soup.patch_names.back().append(suffix);
    }
    for (Index f = 0; f < 6; ++f) {
        std::array<Point, 4> x;
        for (int k = 0; k < 4; ++k) {
            const int v = hex::kFaceVertex[f][inside_out ? 3 - k : k];
            x[k] = low + (high - low) * Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]);
        }
        append_quad(soup, x, first + f);
    }
}

/// Sphere about the origin of n by 2n quads in longitude and latitude.
inline TriangleSoup make_sphere(double radius, int n, const Point& centre = Point(0)) {
    TriangleSoup soup;
    soup.patch_names = {"sphere"};
    const auto at = [&](int i, int j) {
        if (i == 0 || i == n) return centre + Point(0, 0, i == 0 ? radius : -radius);
        const double theta = std::numbers::pi * i / n, phi = std::numbers::pi * j / n;
        return centre + radius * Point(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                       std::cos(theta));
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2 * n; ++j)
            append_quad(soup,
                        {at(i, j), at(i + 1, j), at(i + 1, (j + 1) % (2 * n)), at(i, (j + 1) % (2 * n))}, 0);
    return soup;
}

inline Domain make_domain(const TriangleSoup& soup) {
    Context context(1);
    auto domain = build_domain(soup, {}, context);
    if (!domain) FAIL(domain.error().one_line());
    return std::move(domain).value();
}

} // namespace hexopt::test
