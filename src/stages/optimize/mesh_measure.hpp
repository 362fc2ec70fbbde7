#pragma once

#include "core/parallel.hpp"
#include "mesh/hex_mesh.hpp"

#include <cmath>
#include <limits>
#include <span>

namespace hexopt {

/// Minima of the scaled Jacobian closer than this are decided by the proportions of the cells, if asked for.
inline constexpr double kSameSj = 1e-3;

/// Below it cells count as low.
inline constexpr double kLowScaledJacobian = 0.2;

/// What "never worse" compares, over all cells of the mesh.
struct MeshMeasure {
    std::size_t bad8 = 0, bad32 = 0;
    double min_sj = std::numeric_limits<double>::infinity(), sum_sj = 0;
    std::size_t low = 0; ///< cells below kLowScaledJacobian
    double energy = 0;   ///< against target lengths; 0 without

    bool is_not_worse_than(const MeshMeasure& o) const {
        return bad8 <= o.bad8 && bad32 <= o.bad32 && min_sj >= o.min_sj;
    }
    bool is_better_than(const MeshMeasure& o) const {
        if (bad32 != o.bad32) return bad32 < o.bad32;
        if (bad8 != o.bad8) return bad8 < o.bad8;
        if (energy != o.energy && std::abs(min_sj - o.min_sj) < kSameSj) return energy < o.energy;
        return min_sj != o.min_sj ? min_sj > o.min_sj : sum_sj > o.sum_sj;
    }
};

MeshMeasure measure_mesh(const HexMesh& mesh, std::span<const Point> positions, const Parallel& parallel);

} // namespace hexopt
