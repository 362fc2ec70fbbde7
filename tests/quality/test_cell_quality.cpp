#include "quality/cell_quality.hpp"

#include "quality/exact_oracle.hpp"
#include "quality/hexes.hpp"

#include <catch2/catch.hpp>
#include <limits>

using namespace hexopt;
using namespace hexopt::test;

TEST_CASE("the unit cube is ideal") {
    const CellQuality q = compute_cell_quality(unit_cube());
    CHECK(q.validity.scaled_jacobian == 1);
    CHECK(q.validity.concave8 == 0);
    CHECK(q.validity.concave24 == 0);
    CHECK(q.validity.validity == Validity::valid);
    CHECK(q.volume == 1);
    CHECK(q.min_dihedral == Approx(90));
    CHECK(q.max_dihedral == Approx(90));
    CHECK(q.aspect_ratio() == 1);
}

TEST_CASE("a sheared and a turned-over cube have their closed forms") {
    HexPoints p = unit_cube();
    for (Point& x : p) x.x += x.y;
    CellQuality q = compute_cell_quality(p);
    CHECK(q.validity.scaled_jacobian == Approx(std::sqrt(0.5)));
    CHECK(q.min_dihedral == Approx(45));
    CHECK(q.max_dihedral == Approx(135));
    CHECK(q.aspect_ratio() == Approx(std::sqrt(2.0)));
    CHECK(q.volume == Approx(1));
    for (Point& x : p) x.z = -x.z;
    q = compute_cell_quality(p);
    CHECK(q.validity.scaled_jacobian == Approx(-std::sqrt(0.5)));
    CHECK(q.validity.concave8 == 8);
    CHECK(q.validity.concave24 == 24);
    CHECK(q.validity.validity == Validity::invalid);
    CHECK(q.volume == Approx(-1));
    CHECK(q.min_dihedral == Approx(45));
}

TEST_CASE("a rhombohedron's dihedral angles have their closed form") {
    const double alpha = 1.2; // between each two edges
    const double c = std::cos(alpha), s = std::sin(alpha);
    const double cy = c * (1 - c) / s, cz = std::sqrt(1 - c * c - cy * cy);
    HexPoints p = unit_cube();
    for (Point& x : p) x = Point(x.x + c * x.y + c * x.z, s * x.y + cy * x.z, cz * x.z);
    const double angle = std::acos(c / (1 + c)) * 180 / std::acos(-1.0);
    const CellQuality q = compute_cell_quality(p);
    CHECK(q.min_dihedral == Approx(angle));
    CHECK(q.max_dihedral == Approx(180 - angle));
    CHECK(q.min_edge == Approx(1));
    CHECK(q.max_edge == Approx(1));
}

TEST_CASE("concave tetrahedra are counted exactly on whole-numbered hexes") {
    std::mt19937_64 random(17);
    std::array<int, 33> seen{};
    int zeros = 0;
    for (int n = 0; n < 20000; ++n) {
        const HexPoints p = random_integer_hex(random, n % 2 ? 2 : -2, 1 + n % 3);
        int concave8 = 0, concave24 = 0, flat = 0;
        for (int t = 0; t < 32; ++t) {
            const long long det = whole_tet(p, t);
            flat += det == 0;
            (t % 4 == 0 ? concave8 : concave24) += det <= 0;
        }
        for (double scale : {1.0, 0.1, 1e-6, 1e6}) {
            HexPoints q = p;
            for (Point& x : q) x *= scale;
            // A scale that is not a power of two rounds the coordinates, and with them what is exactly flat.
            if (scale != 1.0 && flat > 0) break;
            const CellValidity cell = compute_cell_validity(q);
            REQUIRE(cell.concave8 == concave8);
            REQUIRE(cell.concave24 == concave24);
        }
        zeros += flat;
        ++seen[concave8 + concave24];
    }
    CHECK(zeros > 1000);
    CHECK(seen[0] > 0);
    CHECK(seen[32] > 0);
}

TEST_CASE("all 32 tetrahedra of a parallelepiped have the sign of its volume") {
    std::mt19937_64 random(19);
    for (int n = 0; n < 100; ++n) {
        // On a parallelepiped each determinant is the volume.
        Point u[3];
        for (Point& a : u) a = random_hex(random, 1)[0];
        HexPoints p;
        for (int k = 0; k < 8; ++k)
            p[k] = double(hex::kVertexX[k]) * u[0] + double(hex::kVertexY[k]) * u[1] +
                   double(hex::kVertexZ[k]) * u[2];
        const CellQuality q = compute_cell_quality(p);
        const bool positive = q.volume > 0;
        CHECK(q.validity.concave8 == (positive ? 0 : 8));
        CHECK(q.validity.concave24 == (positive ? 0 : 24));
        CHECK((q.validity.scaled_jacobian > 0) == positive);
        CHECK(q.validity.validity == (positive ? Validity::valid : Validity::invalid));
    }
}

TEST_CASE("figures do not change with place, orientation, size or numbering") {
    std::mt19937_64 random(23);
    const auto rotations = cube_rotations();
    REQUIRE(rotations.size() == 24);
    const Point axis_x(0.36, 0.48, -0.8), axis_y(-0.8, 0.6, 0), axis_z(0.48, 0.64, 0.6); // orthonormal
    for (int n = 0; n < 500; ++n) {
        const HexPoints p = random_hex(random, 0.1 * (n % 6));
        const CellQuality q = compute_cell_quality(p);
        const auto same = [&](const HexPoints& other, double scale, double tolerance) {
            const CellQuality r = compute_cell_quality(other);
            CHECK(r.validity.scaled_jacobian == Approx(q.validity.scaled_jacobian).margin(tolerance));
            CHECK(r.validity.concave8 == q.validity.concave8);
            CHECK(r.validity.concave24 == q.validity.concave24);
            CHECK(r.validity.validity == q.validity.validity);
            CHECK(r.volume / (scale * scale * scale) == Approx(q.volume).margin(tolerance));
            CHECK(r.min_dihedral == Approx(q.min_dihedral).margin(1e6 * tolerance));
            CHECK(r.max_dihedral == Approx(q.max_dihedral).margin(1e6 * tolerance));
            CHECK(r.min_edge / scale == Approx(q.min_edge).margin(tolerance));
            CHECK(r.max_edge / scale == Approx(q.max_edge).margin(tolerance));
        };
        for (const auto& rotation : rotations) same(renumbered(p, rotation), 1, 1e-13);
        for (double scale : {1e-200, 1e-6, 1e6, 1e80, 1e280}) {
            HexPoints s = p;
            for (Point& x : s) x *= scale;
            if (scale < 1e-100 || scale > 1e100) { // the volume has left the range of double
                const CellValidity r = compute_cell_validity(s);
                CHECK(r.scaled_jacobian == Approx(q.validity.scaled_jacobian).margin(1e-13));
                CHECK(r.concave8 == q.validity.concave8);
                CHECK(r.concave24 == q.validity.concave24);
                CHECK(r.validity == q.validity.validity);
            } else {
                same(s, scale, 1e-13);
            }
        }
        HexPoints moved = p;
        for (Point& x : moved) x = x.x * axis_x + x.y * axis_y + x.z * axis_z + Point(100, -200, 300);
        same(moved, 1, 1e-11);
    }
}

TEST_CASE("degenerate cells have defined figures") {
    HexPoints p = unit_cube();
    p[6] = p[5];
    CellQuality q = compute_cell_quality(p);
    CHECK(q.validity.scaled_jacobian == 0);
    CHECK(q.validity.concave8 == 2);
    CHECK(q.aspect_ratio() == std::numeric_limits<double>::infinity());
    CHECK(q.min_dihedral == 0);
    p.fill(Point(3, 4, 5));
    q = compute_cell_quality(p);
    CHECK(q.validity.scaled_jacobian == 0);
    CHECK(q.validity.concave8 == 8);
    CHECK(q.validity.concave24 == 24);
    CHECK(q.volume == 0);
    for (double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        for (int k = 0; k < 24; ++k) {
            p = unit_cube();
            p[k / 3][k % 3] = bad;
            q = compute_cell_quality(p);
            CHECK_FALSE(q.validity.is_finite);
            CHECK(q.validity.scaled_jacobian == -1);
            CHECK(q.validity.concave8 == 8);
            CHECK(q.validity.concave24 == 24);
            CHECK(q.validity.validity == Validity::invalid);
            CHECK(scaled_jacobian(p) == -1);
        }
}

TEST_CASE("the scaled Jacobian alone is the same number") {
    std::mt19937_64 random(29);
    for (int n = 0; n < 1000; ++n) {
        const HexPoints p = random_hex(random, 0.5);
        CHECK(scaled_jacobian(p) == compute_cell_validity(p).scaled_jacobian);
    }
}

TEST_CASE("the volume is that of a frustum, which is not a parallelepiped") {
    HexPoints p = unit_cube();
    for (int k = 4; k < 8; ++k) p[k] = Point(0.25 + 0.5 * p[k].x, 0.25 + 0.5 * p[k].y, 1);
    CHECK(compute_cell_quality(p).volume == Approx((1 + 0.25 + 0.5) / 3));
}
