#include "quality/certificate.hpp"

#include "quality/exact_oracle.hpp"
#include "quality/hexes.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;
using namespace hexopt::test;

TEST_CASE("the Bernstein coefficients are those of the determinant sampled on a grid") {
    std::mt19937_64 random(3);
    for (int n = 0; n < 200; ++n) {
        const HexPoints p = random_integer_hex(random, 4, 4);
        const auto coefficient = hex::bernstein_coefficients(hex::determinants(hex::edge_vectors<double>(p)));
        const WholeBernstein exact = whole_bernstein(p);
        for (int k = 0; k < 27; ++k) CHECK(512 * coefficient[k] == static_cast<double>(exact[k]));
    }
}

TEST_CASE("the certificate agrees with exact arithmetic on whole-numbered hexes") {
    std::mt19937_64 random(5);
    int count[3] = {}, decided = 0;
    for (int n = 0; n < 6000; ++n) {
        const int size = 2 + n % 5;
        const HexPoints p = random_integer_hex(random, size, 1 + n % 3);
        const Validity validity = certify(p);
        std::optional<int> exact = exact_validity(whole_bernstein(p), 4);
        ++count[static_cast<int>(validity)];
        decided += exact.has_value();
        if (!exact && validity == Validity::invalid) exact = exact_validity(whole_bernstein(p), 12);
        if (validity == Validity::valid) REQUIRE(exact != -1);
        if (validity == Validity::invalid) REQUIRE(exact == -1);
        if (validity == Validity::undecided) REQUIRE(!exact);
    }
    CHECK(count[0] > 500);
    CHECK(count[1] > 500);
    CHECK(count[2] > 10);
    CHECK(decided > 5000);
}

TEST_CASE("a certified cell has no sample that is not positive, an invalid one has a negative one") {
    std::mt19937_64 random(11);
    int valid = 0, invalid_inside = 0;
    for (int n = 0; n < 3000; ++n) {
        const HexPoints p = random_hex(random, 0.25 + 0.05 * (n % 6));
        const Validity validity = certify(p);
        const auto edge = hex::edge_vectors<long double>(p);
        const int steps = 16;
        long double least = 1e300L;
        for (int s = 0; s < (steps + 1) * (steps + 1) * (steps + 1); ++s) {
            const long double x = s % (steps + 1) / static_cast<long double>(steps),
                              y = s / (steps + 1) % (steps + 1) / static_cast<long double>(steps),
                              z = s / (steps + 1) / (steps + 1) / static_cast<long double>(steps);
            const long double a[3] = {x, y, z};
            hex::Vector<long double> column[3] = {};
            for (int e = 0; e < 12; ++e) {
                const int d = e / 4, i = e % 2, j = e / 2 % 2, first = d == 0 ? 1 : 0,
                          second = d == 2 ? 1 : 2;
                const long double weight = (i ? a[first] : 1 - a[first]) * (j ? a[second] : 1 - a[second]);
                for (int k = 0; k < 3; ++k) column[d][k] += weight * edge[e][k];
            }
            least = std::min(least, hex::dot(column[0], hex::cross(column[1], column[2])));
        }
        if (validity == Validity::valid) REQUIRE(least > 0);
        if (least < -1e-15L) REQUIRE(validity == Validity::invalid);
        valid += validity == Validity::valid;
        const CellValidity cell = compute_cell_validity(p);
        invalid_inside += validity == Validity::invalid && cell.concave8 == 0;
    }
    CHECK(valid > 500);
    CHECK(invalid_inside > 3); // negative away from the corners
}

TEST_CASE("a determinant that vanishes at a corner is neither valid nor invalid") {
    HexPoints p = unit_cube();
    p[6] = Point(0.5, 0.5, 0.5); // the corner's three edges stay independent: valid or not, but decided
    CHECK(certify(p) != Validity::undecided);
    p = unit_cube();
    p[1] = 0.5 * (p[0] + p[2]); // a flat corner in one face
    CHECK(certify(p) == Validity::undecided);
    p = unit_cube();
    p[4] = p[0]; // a zero edge
    CHECK(certify(p) == Validity::undecided);
    for (int k = 4; k < 8; ++k) p[k] = p[k - 4]; // flat
    CHECK(certify(p) == Validity::undecided);
    p.fill(Point(1, 2, 3));
    CHECK(certify(p) == Validity::undecided);
}

TEST_CASE("the certificate depends neither on numbering, size nor place") {
    std::mt19937_64 random(13);
    for (int n = 0; n < 300; ++n) {
        const HexPoints p = random_hex(random, 0.4);
        const Validity validity = certify(p);
        for (const auto& rotation : cube_rotations()) CHECK(certify(renumbered(p, rotation)) == validity);
        for (double scale : {1e-6, 1e6})
            for (double shift : {0.0, 100.0}) {
                HexPoints q = p;
                for (Point& x : q) x = scale * (x + shift);
                CHECK(certify(q) == validity);
            }
    }
}
