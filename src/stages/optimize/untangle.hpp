#pragma once

#include "stages/optimize/newton.hpp"

namespace hexopt {

/// Solves the weighted graph Laplacian for the free dofs, boundary fixed: a start from which tangled
/// interiors unfold at once. Exact for lattices across levels (weight V/length^2 per cell and edge).
/// Positions of boundary dofs that may slide stay. Uses the solver's matrix. Returns the
/// number of CG iterations.
int harmonic_start(Newton& newton, std::span<const std::uint8_t> on_boundary, Budget& budget);

/// Garanzha's update: how far eps may fall so that the energy of the worst element still falls. least: min J.
double garanzha_eps(double eps, double least, double energy_before, double energy_after);

struct UntangleResult {
    int rounds = 0, newton_steps = 0, cg_iterations = 0;
    double eps = 0;          ///< regularisation that the last round would go on with
    double min_jacobian = 0; ///< least J / delta over the tetrahedra that can move
};

inline constexpr int kMaxUntangleRounds = 24;

/// Minimises the regularised shape energy while eps falls (Garanzha et al. 2021, with eps <= 0.2 |min J|).
/// size_weight 0: cells have no size, target lengths follow them from round to round. Above 0
/// (HexGroup::size_weight; a tenth of it once all are valid): target lengths are those of the problem that
/// `newton` was opened on, and stay.
UntangleResult untangle_regularised(Minimiser& newton, int max_rounds, Budget& budget,
                                    double size_weight = 0);

} // namespace hexopt
