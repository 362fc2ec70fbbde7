#pragma once

#include "mesh/hex_mesh.hpp"
#include "mesh/hex_reference.hpp"

#include <cmath>
#include <functional>

namespace hexopt::test {

/// Grid of nx*ny*nz cells over [0,1]^3, mapped.
inline HexMesh grid(int nx, int ny, int nz, const std::function<Point(const Point&)>& map) {
    HexMesh mesh;
    auto vertex = [&](int i, int j, int k) { return static_cast<Index>((k * (ny + 1) + j) * (nx + 1) + i); };
    for (int k = 0; k <= nz; ++k)
        for (int j = 0; j <= ny; ++j)
            for (int i = 0; i <= nx; ++i)
                mesh.positions.push_back(map(Point(double(i) / nx, double(j) / ny, double(k) / nz)));
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                Cell cell;
                for (int v = 0; v < 8; ++v)
                    cell[v] = vertex(i + hex::kVertexX[v], j + hex::kVertexY[v], k + hex::kVertexZ[v]);
                mesh.cells.push_back(cell);
            }
    return mesh;
}

inline HexMesh cube(int n) {
    return grid(n, n, n, [](const Point& p) { return p; });
}

/// Ball of radius 1: shells of the cube become spheres.
inline HexMesh ball(int n) {
    return grid(n, n, n, [](const Point& p) {
        const Point q = 2.0 * p - 1.0;
        const double shell = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)});
        const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
        return length > 0 ? q * (shell / length) : q;
    });
}

/// Cylinder of radius 1 and height 2 along z.
inline HexMesh cylinder(int n) {
    return grid(n, n, n, [](const Point& p) {
        const double x = 2 * p.x - 1, y = 2 * p.y - 1;
        const double shell = std::max(std::abs(x), std::abs(y)), length = std::hypot(x, y);
        const double s = length > 0 ? shell / length : 0;
        return Point(x * s, y * s, 2 * p.z);
    });
}

/// Cube whose top slopes down to x = 1, where its height is `low`.
inline HexMesh wedge(int n, double low) {
    return grid(n, n, n, [low](const Point& p) { return Point(p.x, p.y, p.z * (1 - (1 - low) * p.x)); });
}

} // namespace hexopt::test
