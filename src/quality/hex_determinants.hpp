#pragma once

#include "core/types.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>

/// The determinants of three edges of a hexahedron, one along each reference direction, from which
/// tetrahedra, Jacobian and volume follow. Shared by the files of src/quality; not for others.
namespace hexopt::hex {

template <class T>
using Vector = std::array<T, 3>;

template <class T>
Vector<T> cross(const Vector<T>& a, const Vector<T>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class T>
T dot(const Vector<T>& a, const Vector<T>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// The 12 edge vectors, numbered as kEdgeVertex.
template <class T>
std::array<Vector<T>, 12> edge_vectors(const std::array<Point, 8>& p) {
    std::array<Vector<T>, 12> edge;
    for (int e = 0; e < 12; ++e) {
        const Point &from = p[kEdgeVertex[e][0]], &to = p[kEdgeVertex[e][1]];
        for (int i = 0; i < 3; ++i) edge[e][i] = static_cast<T>(to[i]) - static_cast<T>(from[i]);
    }
    return edge;
}

/// Product over the three directions of the largest 1-norm of an edge: no determinant of the cell, nor the
/// sum of the magnitudes of its six products, is larger.
template <class T>
T determinant_scale(const std::array<Vector<T>, 12>& edge) {
    T scale = 1;
    for (int direction = 0; direction < 3; ++direction) {
        T largest = 0;
        for (int e = 4 * direction; e < 4 * direction + 4; ++e)
            largest = std::max(largest, std::abs(edge[e][0]) + std::abs(edge[e][1]) + std::abs(edge[e][2]));
        scale *= largest;
    }
    return scale;
}

/// det(e_xi, e_eta, e_zeta) at [16 a + 4 b + c] for xi edge a, eta edge 4 + b and zeta edge 8 + c.
template <class T>
using Determinants = std::array<T, 64>;

template <class T>
Determinants<T> determinants(const std::array<Vector<T>, 12>& edge) {
    Determinants<T> det;
    for (int b = 0; b < 4; ++b)
        for (int c = 0; c < 4; ++c) {
            const Vector<T> normal = cross(edge[4 + b], edge[8 + c]);
            for (int a = 0; a < 4; ++a) det[16 * a + 4 * b + c] = dot(edge[a], normal);
        }
    return det;
}

/// Place of tetrahedron t of kTetEdge among the determinants.
constexpr int determinant_of_tet(int t) {
    return 16 * kTetEdge[t][0] + 4 * (kTetEdge[t][1] - 4) + (kTetEdge[t][2] - 8);
}

/// The 27 Bernstein coefficients of det J of the trilinear map, degree 2 in each direction; (i,j,k) is at
/// i + 3j + 9k.
template <class T>
using Bernstein = std::array<T, 27>;

/// A product of one edge in each direction, of degree (0,1,1), (1,0,1) and (1,1,0), adds to the coefficient
/// whose index is the sum of the three places.
template <class T>
Bernstein<T> bernstein_coefficients(const Determinants<T>& det) {
    static constexpr std::array<std::uint8_t, 64> kTarget = [] {
        std::array<std::uint8_t, 64> target{};
        for (int n = 0; n < 64; ++n) {
            const int a = n / 16, b = n / 4 % 4, c = n % 4;
            target[n] = static_cast<std::uint8_t>((b & 1) + (c & 1) + 3 * ((a & 1) + (c >> 1)) +
                                                  9 * ((a >> 1) + (b >> 1)));
        }
        return target;
    }();
    Bernstein<T> coefficient{};
    for (int n = 0; n < 64; ++n) coefficient[kTarget[n]] += det[n];
    for (int n = 0; n < 27; ++n) {
        const int halvings = (n % 3 == 1) + (n / 3 % 3 == 1) + (n / 9 == 1);
        coefficient[n] *= static_cast<T>(1) / static_cast<T>(1 << halvings);
    }
    return coefficient;
}

} // namespace hexopt::hex
