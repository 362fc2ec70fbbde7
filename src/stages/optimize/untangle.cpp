#include "stages/optimize/untangle.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr double kStartEps = 0.05;
constexpr double kLeastEps = 1e-5; ///< while anything is tangled
constexpr int kMaxStalledRounds = 6;
/// Of size_weight, once nothing is tangled: then shape counts.
constexpr double kValidSizeShare = 0.1;

} // namespace

double garanzha_eps(double eps, double least, double energy_before, double energy_after) {
    const double sigma = std::max(1 - energy_after / energy_before, 0.1);
    const double mu = (1 - sigma) * (least + std::sqrt(least * least + eps * eps)) / 2;
    if (least < mu) return 2 * std::sqrt(mu * (mu - least));
    return kLeastEps;
}

int harmonic_start(Newton& newton, std::span<const std::uint8_t> on_boundary, Budget& budget) {
    const Problem& problem = newton.problem();
    BlockMatrix& matrix = newton.matrix();
    std::vector<Point>& positions = newton.positions();
    matrix.set_zero();
    const std::span<Point> rhs = newton.right_hand_side(), step = newton.solution();
    std::fill(rhs.begin(), rhs.end(), Point(0));
    const auto fixed = [&](Index dof) { return on_boundary[problem.dof_vertex()[dof]] != 0; };
    for (std::size_t c = 0; c < problem.cell_count(); ++c) {
        const Cell& cell = problem.cell(c);
        // V / length^2 of a cell of size 2^-level is proportional to 2^-level.
        const float cell_weight = std::sqrt(problem.weight()[c]);
        for (std::size_t e = 0; e < 12; ++e) {
            const auto& edge = hex::kEdgeVertex[e];
            const float stretch =
                problem.inverse_stretch()
                    ? problem.inverse_stretch()[3 * std::size_t{problem.cell_id()[c]} + e / 4]
                    : 1;
            const float weight = cell_weight * stretch * stretch;
            const Index ends[2] = {cell[edge[0]], cell[edge[1]]};
            for (int i = 0; i < 2; ++i)
                for (DofShare a : problem.shares(ends[i])) {
                    if (fixed(a.dof)) continue;
                    rhs[a.dof] += static_cast<double>(weight * a.weight) *
                                  (positions[ends[1 - i]] - positions[ends[i]]);
                    for (int j = 0; j < 2; ++j)
                        for (DofShare b : problem.shares(ends[j]))
                            if (b.dof >= a.dof && !fixed(b.dof))
                                matrix.add_scaled_identity(
                                    a.dof, b.dof, (i == j ? 1.0f : -1.0f) * weight * a.weight * b.weight);
                }
        }
    }
    for (Index d = 0; d < problem.dof_count(); ++d)
        if (fixed(d)) matrix.add_scaled_identity(d, d, 1);
    const CgResult cg = solve_cg(matrix, rhs, {}, step, 1e-8, 200, budget.parallel());
    for (std::size_t d = 0; d < step.size(); ++d) positions[problem.dof_vertex()[d]] += step[d];
    problem.apply_hanging(positions);
    return cg.iterations;
}

UntangleResult untangle_regularised(Minimiser& newton, int max_rounds, Budget& budget, double size_weight) {
    const bool has_sizes = size_weight > 0;
    UntangleResult result;
    const Resolution resolution = newton.resolution();
    if (!has_sizes) newton.update_lengths();
    Objective objective;
    objective.size_weight = size_weight;
    // A valid mesh must not be let through the barrier again.
    objective.eps =
        newton.evaluate(objective).min_jacobian > resolution.least_valid ? resolution.valid_eps : kStartEps;
    NewtonOptions options;
    int valid_rounds = 0, stalled_rounds = 0;
    for (result.rounds = 0; result.rounds < max_rounds && !budget.exhausted(); ++result.rounds) {
        if (!has_sizes) newton.update_lengths();
        const NewtonResult step = newton.minimise(objective, options);
        result.newton_steps += step.steps;
        result.cg_iterations += step.cg_iterations;
        result.min_jacobian = step.end.min_jacobian;
        const double decrease = 1 - step.end.energy / step.start.energy;
        budget.context().log(
            LogLevel::debug,
            fmt::format("round {}: eps {:.3e}, energy {:.6e} -> {:.6e}, least J {:.3e}, {} steps, {} cg",
                        result.rounds, objective.eps, step.start.energy, step.end.energy,
                        step.end.min_jacobian, step.steps, step.cg_iterations));
        if (step.end.min_jacobian > resolution.least_valid) {
            stalled_rounds = 0;
            objective.eps = resolution.valid_eps;
            objective.size_weight = kValidSizeShare * size_weight;
            if (++valid_rounds > 1 && decrease < 2e-3) break;
            continue;
        }
        stalled_rounds = decrease < 1e-4 ? stalled_rounds + 1 : 0;
        if (stalled_rounds >= kMaxStalledRounds) break;
        const double least = step.end.min_jacobian;
        objective.eps = std::max(
            kLeastEps, std::min(0.2 * std::abs(least),
                                garanzha_eps(objective.eps, least, step.start.energy, step.end.energy)));
    }
    result.eps = objective.eps;
    return result;
}

} // namespace hexopt
