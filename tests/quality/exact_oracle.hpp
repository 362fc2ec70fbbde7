#pragma once

#include "quality/cell_quality.hpp"

#include <array>
#include <optional>

/// Exact answers for cells with small whole coordinates, reached on other ways than the library's.
namespace hexopt::test {

using Whole = __int128; // 12 levels of subdivision of coordinates up to 16 stay below 2^110
using WholeVector = std::array<long long, 3>;

inline long long whole_determinant(const WholeVector& a, const WholeVector& b, const WholeVector& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) +
           c[0] * (a[1] * b[2] - a[2] * b[1]);
}

/// 64 det J at (x, y, z) / 2, each in 0..2, by differentiating the trilinear interpolation.
inline long long jacobian_times_64(const HexPoints& p, int x, int y, int z) {
    WholeVector column[3] = {};
    const int at[3] = {x, y, z};
    for (int k = 0; k < 8; ++k) {
        const int bit[3] = {hex::kVertexX[k], hex::kVertexY[k], hex::kVertexZ[k]};
        for (int d = 0; d < 3; ++d) {
            long long factor = bit[d] ? 1 : -1; // derivative, and 2 * shape function in the other directions
            for (int o = 0; o < 3; ++o)
                if (o != d) factor *= bit[o] ? at[o] : 2 - at[o];
            for (int i = 0; i < 3; ++i) column[d][i] += factor * static_cast<long long>(p[k][i]);
        }
    }
    return whole_determinant(column[0], column[1], column[2]);
}

using WholeBernstein = std::array<Whole, 27>;

/// 512 times the Bernstein coefficients of det J, interpolated from its values on the 3x3x3 grid.
inline WholeBernstein whole_bernstein(const HexPoints& p) {
    WholeBernstein b;
    for (int n = 0; n < 27; ++n) b[n] = 8 * jacobian_times_64(p, n % 3, n / 3 % 3, n / 9);
    for (int stride : {1, 3, 9})
        for (int n = 0; n < 27; ++n)
            if (n / stride % 3 == 1) b[n] = (4 * b[n] - b[n - stride] - b[n + stride]) / 2;
    return b;
}

/// -1: det J < 0 somewhere; 1: > 0 everywhere; nothing when subdivision to `depth` leaves it open.
inline std::optional<int> exact_validity(const WholeBernstein& b, int depth) {
    bool all_positive = true, all_nonnegative = true;
    for (const Whole& x : b) {
        all_positive = all_positive && x > 0;
        all_nonnegative = all_nonnegative && x >= 0;
    }
    if (all_positive) return 1;
    for (int corner : {0, 2, 6, 8, 18, 20, 24, 26})
        if (b[corner] < 0) return -1;
    if (depth == 0 || all_nonnegative) return std::nullopt; // touches zero at most
    std::vector<WholeBernstein> parts = {b};
    for (int stride : {1, 3, 9}) { // halves times 4, so that they stay whole
        std::vector<WholeBernstein> halves;
        for (const WholeBernstein& part : parts) {
            WholeBernstein low, high;
            for (int n = 0; n < 27; ++n) {
                if (n / stride % 3 != 0) continue;
                const Whole &b0 = part[n], &b1 = part[n + stride], &b2 = part[n + 2 * stride];
                low[n] = 4 * b0;
                low[n + stride] = 2 * (b0 + b1);
                low[n + 2 * stride] = high[n] = b0 + 2 * b1 + b2;
                high[n + stride] = 2 * (b1 + b2);
                high[n + 2 * stride] = 4 * b2;
            }
            halves.push_back(low);
            halves.push_back(high);
        }
        parts.swap(halves);
    }
    bool open = false;
    for (const WholeBernstein& part : parts) {
        const std::optional<int> answer = exact_validity(part, depth - 1);
        if (answer == -1) return -1;
        open = open || !answer;
    }
    if (open) return std::nullopt;
    return 1;
}

/// Determinant of one of the 32 tetrahedra, from the definition: three edges, one along each direction.
inline long long whole_tet(const HexPoints& p, int tet) {
    WholeVector v[3];
    for (int d = 0; d < 3; ++d) {
        const auto& ends = hex::kEdgeVertex[hex::kTetEdge[tet][d]];
        for (int i = 0; i < 3; ++i) v[d][i] = static_cast<long long>(p[ends[1]][i] - p[ends[0]][i]);
    }
    return whole_determinant(v[0], v[1], v[2]);
}

} // namespace hexopt::test
