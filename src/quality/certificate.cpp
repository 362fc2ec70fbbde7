#include "quality/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hexopt {

namespace {

using hex::Bernstein;

constexpr std::array<int, 8> kCorners = {0, 2, 6, 8, 18, 20, 24, 26}; // coefficients that are values
constexpr int kMaxLevel = 12;
constexpr std::size_t kMaxBoxes = 600;

// A coefficient differs from the exact one by at most this many unit roundoffs times the scale: 8 for a
// determinant (Shewchuk 1997, orient3d), 7 for a sum of 8, one for higher-order terms.
constexpr int kRoundoffsAtStart = 16;
// Each level averages twice in each of three directions, one rounding of at most a unit roundoff each.
constexpr int kRoundoffsPerLevel = 8;

template <class T>
T error_bound(T scale, int level) {
    const T unit_roundoff = std::numeric_limits<T>::epsilon() / 2;
    return static_cast<T>(kRoundoffsAtStart + kRoundoffsPerLevel * level) * unit_roundoff * scale;
}

/// Validity as far as the coefficients of a box tell; `undecided` asks for subdivision.
template <class T>
Validity judge_box(const Bernstein<T>& coefficient, T bound) {
    if (*std::min_element(coefficient.begin(), coefficient.end()) > bound) return Validity::valid;
    for (int corner : kCorners)
        if (coefficient[corner] < -bound) return Validity::invalid;
    return Validity::undecided;
}

/// Cuts a box in the middle of the direction whose coefficients are `stride` apart; the lower half stays in
/// `box`, the upper one is returned (de Casteljau).
template <class T>
Bernstein<T> split(Bernstein<T>& box, int stride) {
    Bernstein<T> upper;
    const T half = static_cast<T>(0.5);
    for (int row = 0; row < 9; ++row) {
        const int first = row % stride + row / stride * 3 * stride;
        T &b0 = box[first], &b1 = box[first + stride], &b2 = box[first + 2 * stride];
        const T low = (b0 + b1) * half, high = (b1 + b2) * half, middle = (low + high) * half;
        upper[first] = middle;
        upper[first + stride] = high;
        upper[first + 2 * stride] = b2;
        b1 = low;
        b2 = middle;
    }
    return upper;
}

template <class T>
std::array<Bernstein<T>, 8> split_in_eight(const Bernstein<T>& box) {
    std::array<Bernstein<T>, 8> part;
    part[0] = box;
    int count = 1;
    for (int stride : {1, 3, 9}) {
        for (int i = 0; i < count; ++i) part[count + i] = split(part[i], stride);
        count *= 2;
    }
    return part;
}

template <class T>
Validity certify_by_subdivision(const Bernstein<T>& coefficients, T scale) {
    const Validity whole = judge_box(coefficients, error_bound(scale, 0));
    if (whole != Validity::undecided) return whole;
    std::vector<Bernstein<T>> open = {coefficients}, next;
    std::size_t boxes = 0;
    bool left_out = false;
    for (int level = 1; level <= kMaxLevel; ++level) {
        const T bound = error_bound(scale, level);
        next.clear();
        for (const Bernstein<T>& box : open) {
            if (++boxes > kMaxBoxes) return Validity::undecided;
            for (const Bernstein<T>& part : split_in_eight(box)) {
                const Validity validity = judge_box(part, bound);
                if (validity == Validity::invalid) return validity;
                if (validity == Validity::valid) continue;
                // The next level is not going to see more boxes than the budget has left.
                if (boxes + next.size() < kMaxBoxes)
                    next.push_back(part);
                else
                    left_out = true;
            }
        }
        if (next.empty()) return left_out ? Validity::undecided : Validity::valid;
        open.swap(next);
    }
    return Validity::undecided;
}

/// Whether a corner's determinant vanishes, as far as this precision tells: such a cell is not valid.
template <class T>
bool has_flat_corner(const Bernstein<T>& coefficient, T scale) {
    const T bound = error_bound(scale, 0);
    return std::any_of(kCorners.begin(), kCorners.end(),
                       [&](int corner) { return std::abs(coefficient[corner]) <= bound; });
}

} // namespace

const char* name_of(Validity validity) {
    switch (validity) {
    case Validity::valid:
        return "valid";
    case Validity::invalid:
        return "invalid";
    case Validity::undecided:
        return "undecided";
    }
    return "unknown";
}

Validity certify(const std::array<Point, 8>& points, const Bernstein<double>& coefficients, double scale) {
    const Validity validity = certify_by_subdivision(coefficients, scale);
    if (validity != Validity::undecided) return validity;
    const auto edge = hex::edge_vectors<long double>(points);
    const auto precise = hex::bernstein_coefficients(hex::determinants(edge));
    const auto precise_scale = hex::determinant_scale(edge);
    // With a flat corner all that is left to find is a value too little below zero for double to tell.
    if (has_flat_corner(precise, precise_scale)) return Validity::undecided;
    return certify_by_subdivision(precise, precise_scale);
}

Validity certify(const std::array<Point, 8>& points) {
    const auto edge = hex::edge_vectors<double>(points);
    return certify(points, hex::bernstein_coefficients(hex::determinants(edge)),
                   hex::determinant_scale(edge));
}

} // namespace hexopt
