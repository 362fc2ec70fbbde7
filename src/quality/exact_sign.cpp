#include "quality/exact_sign.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

namespace hexopt {

namespace {

/// A number as the exact sum of its components, which do not overlap and grow in magnitude; zeros are left
/// out.
using Expansion = std::vector<double>;

struct Pair {
    double high, low; ///< high + low is the exact result, high the rounded one
};

Pair two_sum(double a, double b) {
    const double sum = a + b;
    const double b_virtual = sum - a;
    const double a_virtual = sum - b_virtual;
    return {sum, (a - a_virtual) + (b - b_virtual)};
}

Pair two_product(double a, double b) {
    const double product = a * b;
    return {product, std::fma(a, b, -product)};
}

void add_to(Expansion& expansion, double value) {
    std::size_t kept = 0;
    for (double component : expansion) {
        const Pair sum = two_sum(value, component);
        if (sum.low != 0) expansion[kept++] = sum.low;
        value = sum.high;
    }
    expansion.resize(kept);
    if (value != 0) expansion.push_back(value);
}

Expansion difference(double a, double b) {
    Expansion result;
    add_to(result, a);
    add_to(result, -b);
    return result;
}

void add_product_to(Expansion& sum, const Expansion& a, const Expansion& b, double sign) {
    for (double x : a)
        for (double y : b) {
            const Pair product = two_product(x, sign * y);
            add_to(sum, product.low);
            add_to(sum, product.high);
        }
}

using ExactVector = std::array<Expansion, 3>;

/// The segment's vector times 2^exponent.
ExactVector exact_vector(const Segment& s, int exponent) {
    ExactVector v;
    for (int i = 0; i < 3; ++i)
        v[i] = difference(std::ldexp(s.to[i], exponent), std::ldexp(s.from[i], exponent));
    return v;
}

double largest_coordinate(const Segment& s) {
    double largest = 0;
    for (int i = 0; i < 3; ++i) largest = std::max({largest, std::abs(s.from[i]), std::abs(s.to[i])});
    return largest;
}

} // namespace

int exact_sign_of_determinant(const Segment& a, const Segment& b, const Segment& c) {
    const double largest = std::max({largest_coordinate(a), largest_coordinate(b), largest_coordinate(c)});
    assert(std::isfinite(largest));
    if (largest == 0) return 0;
    const int exponent = -std::ilogb(largest);
    const ExactVector u = exact_vector(a, exponent), v = exact_vector(b, exponent),
                      w = exact_vector(c, exponent);
    Expansion determinant;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        Expansion minor;
        add_product_to(minor, v[j], w[k], 1);
        add_product_to(minor, v[k], w[j], -1);
        add_product_to(determinant, u[i], minor, 1);
    }
    if (determinant.empty()) return 0;
    return determinant.back() > 0 ? 1 : -1;
}

} // namespace hexopt
