#pragma once

#include "mesh/triangle_soup.hpp"

#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/trigonometric.hpp>

namespace hexopt::test {

/// Planes of constant z become planes across `axis`; x and y become the two axes after it in turn.
inline Point permuted(const Point& p, int axis) {
    Point out;
    for (int k = 0; k < 3; ++k) out[(axis + 1 + k) % 3] = p[k];
    return out;
}

inline TriangleSoup permuted(TriangleSoup soup, int axis) {
    for (Point& p : soup.vertices) p = permuted(p, axis);
    return soup;
}

/// Turned about x, then y, then z, degrees.
inline glm::dmat3 turn(const Point& degrees) {
    glm::dmat3 all(1);
    for (int axis = 0; axis < 3; ++axis) {
        const double a = glm::radians(degrees[axis]), c = std::cos(a), s = std::sin(a);
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        glm::dmat3 one(1);
        one[u][u] = one[v][v] = c;
        one[u][v] = s;
        one[v][u] = -s;
        all = one * all;
    }
    return all;
}

inline TriangleSoup turned(TriangleSoup soup, const Point& degrees, const Point& shift) {
    const glm::dmat3 by = turn(degrees);
    for (Point& p : soup.vertices) p = by * p + shift;
    return soup;
}

/// As an STL file holds it.
inline TriangleSoup rounded(TriangleSoup soup) {
    for (Point& p : soup.vertices)
        for (int k = 0; k < 3; ++k) p[k] = static_cast<float>(p[k]);
    return soup;
}

} // namespace hexopt::test
