// Agreement with Verdict, through VTK, on random hexes.
#include "quality/cell_quality.hpp"
#include "quality/hexes.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vtkHexahedron.h>
#include <vtkMath.h>
#include <vtkMeshQuality.h>
#include <vtkNew.h>
#include <vtkPoints.h>

using namespace hexopt;
using namespace hexopt::test;

namespace {

void set_points(vtkHexahedron& cell, const HexPoints& p) {
    for (int k = 0; k < 8; ++k) {
        cell.GetPoints()->SetPoint(k, p[k].x, p[k].y, p[k].z);
        cell.GetPointIds()->SetId(k, k);
    }
}

/// Of the edges as VTK lists them. (Verdict's own edge ratio, in VTK 9.1, misses the extreme edge of some
/// cells.)
std::pair<double, double> vtk_edge_range(vtkHexahedron& cell) {
    double least = 1e300, most = 0;
    for (int e = 0; e < 12; ++e) {
        double a[3], b[3];
        cell.GetEdge(e)->GetPoints()->GetPoint(0, a);
        cell.GetEdge(e)->GetPoints()->GetPoint(1, b);
        const double length = std::sqrt(vtkMath::Distance2BetweenPoints(a, b));
        least = std::min(least, length);
        most = std::max(most, length);
    }
    return {least, most};
}

/// Verdict's scaled Jacobian has a ninth sample in the centre.
double centre_scaled_jacobian(const HexPoints& p) {
    Point axis[3] = {};
    for (int k = 0; k < 8; ++k) {
        axis[0] += p[k] * (hex::kVertexX[k] ? 1.0 : -1.0);
        axis[1] += p[k] * (hex::kVertexY[k] ? 1.0 : -1.0);
        axis[2] += p[k] * (hex::kVertexZ[k] ? 1.0 : -1.0);
    }
    const auto length = [](const Point& a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); };
    const Point &a = axis[0], &b = axis[1], &c = axis[2];
    const double det =
        a.x * (b.y * c.z - b.z * c.y) - a.y * (b.x * c.z - b.z * c.x) + a.z * (b.x * c.y - b.y * c.x);
    return det / (length(a) * length(b) * length(c));
}

/// By projecting on the plane across each edge: another way than the corner normals.
std::pair<double, double> projected_dihedral(const HexPoints& p) {
    double least = 180, most = 0;
    const auto dot = [](const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    for (int k = 0; k < 8; ++k) {
        const int x = hex::kVertexX[k], y = hex::kVertexY[k], z = hex::kVertexZ[k];
        const Point e[3] = {p[hex::vertex_at(1 - x, y, z)] - p[k], p[hex::vertex_at(x, 1 - y, z)] - p[k],
                            p[hex::vertex_at(x, y, 1 - z)] - p[k]};
        for (int d = 0; d < 3; ++d) {
            const Point axis = e[d] / std::sqrt(dot(e[d], e[d]));
            Point a = e[(d + 1) % 3], b = e[(d + 2) % 3];
            a -= axis * dot(a, axis);
            b -= axis * dot(b, axis);
            const double cosine = std::clamp(dot(a, b) / std::sqrt(dot(a, a) * dot(b, b)), -1.0, 1.0);
            const double angle = std::acos(cosine) * 180 / std::acos(-1.0);
            least = std::min(least, angle);
            most = std::max(most, angle);
        }
    }
    return {least, most};
}

} // namespace

TEST_CASE("scaled Jacobian, edges and dihedral angles agree with Verdict and VTK on random hexes") {
    std::mt19937_64 random(43);
    vtkNew<vtkHexahedron> cell;
    for (int n = 0; n < 5000; ++n) {
        const HexPoints p = random_hex(random, 0.02 * (n % 25));
        set_points(*cell, p);
        const CellQuality q = compute_cell_quality(p);
        const double with_centre = std::min(q.validity.scaled_jacobian, centre_scaled_jacobian(p));
        REQUIRE(vtkMeshQuality::HexScaledJacobian(cell) == Approx(with_centre).margin(1e-12));
        const auto [shortest, longest] = vtk_edge_range(*cell);
        REQUIRE(q.min_edge == Approx(shortest).epsilon(1e-12));
        REQUIRE(q.max_edge == Approx(longest).epsilon(1e-12));
        const auto [least, most] = projected_dihedral(p);
        REQUIRE(q.min_dihedral == Approx(least).margin(1e-5));
        REQUIRE(q.max_dihedral == Approx(most).margin(1e-5));
    }
}

TEST_CASE("the trilinear volume agrees with Gauss quadrature, which is exact for it") {
    std::mt19937_64 random(47);
    const double node[2] = {0.5 - std::sqrt(1.0 / 12), 0.5 + std::sqrt(1.0 / 12)};
    for (int n = 0; n < 2000; ++n) {
        const HexPoints p = random_hex(random, 0.5);
        double volume = 0;
        for (int g = 0; g < 8; ++g) {
            const double at[3] = {node[g & 1], node[g >> 1 & 1], node[g >> 2]};
            Point column[3] = {};
            for (int k = 0; k < 8; ++k) {
                const int bit[3] = {hex::kVertexX[k], hex::kVertexY[k], hex::kVertexZ[k]};
                for (int d = 0; d < 3; ++d) {
                    double factor = bit[d] ? 1 : -1;
                    for (int o = 0; o < 3; ++o)
                        if (o != d) factor *= bit[o] ? at[o] : 1 - at[o];
                    column[d] += p[k] * factor;
                }
            }
            const Point &a = column[0], &b = column[1], &c = column[2];
            volume += (a.x * (b.y * c.z - b.z * c.y) - a.y * (b.x * c.z - b.z * c.x) +
                       a.z * (b.x * c.y - b.y * c.x)) /
                      8;
        }
        REQUIRE(compute_cell_quality(p).volume == Approx(volume).margin(1e-13));
    }
}
