#pragma once

#include "mesh/triangle_soup.hpp"

#include <initializer_list>

namespace hexopt::test {

/// Adds a convex polygon as a fan from its first vertex.
inline void add_polygon(TriangleSoup& soup, std::initializer_list<Index> polygon) {
    const std::vector<Index> p(polygon);
    for (std::size_t k = 1; k + 1 < p.size(); ++k) soup.triangles.push_back({p[0], p[k], p[k + 1]});
}

/// A box of 4 x 1 x 1 whose edge y = z = 1 is cut off: nothing at A (x = 0), 0.2 along y (to P) and 0.4 along
/// z (to Q) at x = 4. The cut face turns by 63 degrees from the top (along AP) and by 27 from the side (AQ).
inline TriangleSoup tapered_chamfer() {
    TriangleSoup soup;
    soup.vertices = {{0, 0, 0}, {4, 0, 0},   {4, 1, 0}, {0, 1, 0},  {0, 0, 1},
                     {4, 0, 1}, {4, 0.8, 1}, {0, 1, 1}, {4, 1, 0.6}};
    add_polygon(soup, {0, 3, 2, 1});
    add_polygon(soup, {4, 5, 6, 7});
    add_polygon(soup, {3, 7, 8, 2});
    add_polygon(soup, {7, 6, 8});
    add_polygon(soup, {1, 2, 8, 6, 5});
    add_polygon(soup, {0, 4, 7, 3});
    add_polygon(soup, {0, 1, 5, 4});
    return soup;
}

} // namespace hexopt::test
