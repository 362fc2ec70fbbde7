#include "quality/exact_sign.hpp"

#include <boost/multiprecision/cpp_int.hpp>
#include <catch2/catch.hpp>
#include <random>

using namespace hexopt;
using Rational = boost::multiprecision::cpp_rational;

namespace {

int rational_sign(const Segment& a, const Segment& b, const Segment& c) {
    Rational m[3][3];
    const Segment* s[3] = {&a, &b, &c};
    for (int r = 0; r < 3; ++r)
        for (int i = 0; i < 3; ++i) m[r][i] = Rational(s[r]->to[i]) - Rational(s[r]->from[i]);
    const Rational det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return det.sign();
}

} // namespace

TEST_CASE("the exact sign agrees with rational arithmetic on nearly flat edges") {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> coordinate(-1, 1);
    const auto point = [&] { return Point(coordinate(random), coordinate(random), coordinate(random)); };
    int seen[3] = {};
    for (int n = 0; n < 3000; ++n) {
        const double size = std::ldexp(1, n % 7 * 60 - 180), offset = n % 3 ? 0 : 1e3 * size;
        const Point o = size * point() + offset;
        const Segment a{o, o + size * point()}, b{o, o + size * point()};
        // The third edge lies in the plane of the others but for rounding, or exactly.
        const double s = coordinate(random), t = n % 5 == 0 ? 0 : coordinate(random);
        Segment c{o, o + s * (a.to - o) + t * (b.to - o)};
        if (n % 10 == 0) c = {a.to, a.from};
        if (n % 11 == 0) c.to = c.from;
        const int sign = exact_sign_of_determinant(a, b, c);
        REQUIRE(sign == rational_sign(a, b, c));
        ++seen[sign + 1];
    }
    CHECK(seen[0] > 100);
    CHECK(seen[1] > 100);
    CHECK(seen[2] > 100);
}

TEST_CASE("the exact sign is that of the coordinates, far from the origin and at extreme sizes") {
    for (double size : {1e-290, 1e-6, 1.0, 1e6, 1e290}) {
        const Segment x{{0, 0, 0}, {size, 0, 0}}, y{{0, 0, 0}, {0, size, 0}}, z{{0, 0, 0}, {0, 0, size}};
        CHECK(exact_sign_of_determinant(x, y, z) == 1);
        CHECK(exact_sign_of_determinant(y, x, z) == -1);
        CHECK(exact_sign_of_determinant(x, x, z) == 0);
    }
    const Segment nothing{{0, 0, 0}, {0, 0, 0}};
    CHECK(exact_sign_of_determinant(nothing, nothing, nothing) == 0);
}
