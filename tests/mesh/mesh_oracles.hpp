#pragma once

#include "mesh/hex_reference.hpp"
#include "mesh/topology.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <array>

namespace hexopt::test {

inline HexMesh sample(std::string_view name, const SampleOptions& options = {}, std::uint64_t seed = 1) {
    Context context(2, seed);
    auto mesh = make_sample(name, options, context);
    if (!mesh) FAIL(mesh.error().one_line());
    return std::move(mesh).value();
}

/// All samples with hanging vertices.
inline const std::vector<std::string> kOctrees = {"octree-corner", "octree-sphere",  "octree-warped",
                                                  "octree-ball",   "octree-trimmed", "octree-halved"};

/// Integral of x·n / 3 over a bilinear quad, by 3x3 Gauss points (exact for this integrand).
inline double flux_through(const std::array<Point, 4>& q) {
    const double g = std::sqrt(0.6);
    const std::array<double, 3> at = {(1 - g) / 2, 0.5, (1 + g) / 2}, weight = {5 / 18.0, 8 / 18.0, 5 / 18.0};
    double sum = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const double u = at[i], v = at[j];
            const Point x = (1 - u) * (1 - v) * q[0] + u * (1 - v) * q[1] + u * v * q[2] + (1 - u) * v * q[3];
            const Point du = (1 - v) * (q[1] - q[0]) + v * (q[2] - q[3]);
            const Point dv = (1 - u) * (q[3] - q[0]) + u * (q[2] - q[1]);
            sum += weight[i] * weight[j] * glm::dot(x, glm::cross(du, dv)) / 3;
        }
    return sum;
}

inline double flux_through(const HexMesh& mesh, CellFace face) {
    const Quad q = face_vertices(mesh, face);
    const auto& x = mesh.positions;
    return flux_through({x[q[0]], x[q[1]], x[q[2]], x[q[3]]});
}

/// Volume of the trilinear cells, through their faces.
inline double volume_of_cells(const HexMesh& mesh) {
    double sum = 0;
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (std::uint32_t f = 0; f < 6; ++f) sum += flux_through(mesh, {c, f});
    return sum;
}

inline void require_same(const Hanging& a, const Hanging& b) {
    REQUIRE(a.vertex == b.vertex);
    REQUIRE(a.offset == b.offset);
    REQUIRE(a.master == b.master);
    REQUIRE(a.weight == b.weight);
}

} // namespace hexopt::test
