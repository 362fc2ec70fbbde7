#pragma once

#include "mesh/hex_mesh.hpp"

namespace hexopt {

/// Cells per call of a kernel: a multiple of every vector width.
inline constexpr int kGroup = 16;

/// Up to kGroup cells and the energy they are measured with.
///   E = shape_weight * weight * sum over tets (S + size_weight) / (3 chi(J)^(2/3)) + penalty_weight * sum
///   over corners (theta - SJ)+^2
struct HexGroup {
    const Point* positions;        ///< of the whole mesh
    const Cell* cells;             ///< see cell_id
    const float* inverse_length;   ///< one a cell of the group: 1 / target edge length (1 / model unit)
    const float* weight;           ///< one a cell of the group
    const std::uint32_t* tet_mask; ///< one a cell of the group: bit t: tetrahedron t (hex::kTetEdge) counts
    int count;                     ///< 1..kGroup
    double eps;                    ///< regularisation of J, > 0
    double shape_weight = 1;
    double penalty_weight = 0;      ///< 0: no penalty on the scaled Jacobian
    double theta = 0;               ///< scaled Jacobian below which a corner is penalised
    const Index* cell_id = nullptr; ///< places of the group's cells in `cells`; null: the first `count`
    /// 3 a place in `cells`: inverse target lengths along xi, eta, zeta relative to the cell's; null: 1.
    const float* inverse_stretch = nullptr;
    /// Added to S, >= 0: what keeps cells from shrinking away, since S / chi^(2/3) of a cell that stays
    /// inverted falls with its size. An ideal cell of the target size has S = 3.
    double size_weight = 0;
};

struct HexValue {
    alignas(64) double energy[kGroup];
    alignas(64) double min_jacobian[kGroup]; ///< least J (in target units) over the counted tetrahedra
};

struct HexGradient {
    HexValue value;
    alignas(64) double gradient[24][kGroup]; ///< [3 * vertex + axis][cell], per model unit
};

/// Upper triangle of the symmetric 8x8 matrix of 3x3 blocks; block (i, j), i <= j, is number i*(15-i)/2 + j,
/// stored row by row.
struct HexHessian {
    alignas(64) float block[36 * 9][kGroup];
};

constexpr int hessian_block(int i, int j) { return i * (15 - i) / 2 + j; }

/// Over the counted tetrahedra; above 1e37 where none counts.
struct HexMeasure {
    alignas(64) double min_sj[kGroup];    ///< least scaled Jacobian of the 8 corners
    alignas(64) double min_det8[kGroup];  ///< least J of the corner tetrahedra, target units
    alignas(64) double min_det32[kGroup]; ///< least J of all tetrahedra
};

/// One instruction set's kernels. All of them give the same bits.
struct HexKernels {
    const char* name;
    void (*value)(const HexGroup&, HexValue&);
    void (*gradient)(const HexGroup&, HexGradient&);
    void (*hessian)(const HexGroup&, HexHessian&);
    void (*measure)(const HexGroup&, HexMeasure&);
};

/// The widest that this processor runs: AVX-512, AVX2 or the architecture's baseline.
const HexKernels& hex_kernels();

/// All that this processor runs, widest first (tests, benchmarks).
std::vector<const HexKernels*> available_hex_kernels();

} // namespace hexopt
