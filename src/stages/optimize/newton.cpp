#include "stages/optimize/newton.hpp"

#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr std::size_t kEnergyChunk = 256;
constexpr int kMaxHalvings = 8;
constexpr int kMaxPinnings = 4;
constexpr double kClampedFraction = 0.1;
constexpr double kArmijo = 1e-4;

HexGroup group_of(const Problem& problem, const Objective& objective, std::span<const Point> positions,
                  std::size_t begin, std::size_t end) {
    return {positions.data(),
            &problem.cells()[begin],
            &problem.inverse_length()[3 * begin],
            &problem.weight()[begin],
            &problem.tet_mask()[begin],
            static_cast<int>(end - begin),
            objective.eps,
            objective.shape_weight,
            objective.penalty_weight,
            objective.theta};
}

} // namespace

Newton::Newton(Problem& problem, std::vector<Point>& positions, const Motion* motion, Budget& budget)
    : problem_(problem), positions_(positions), motion_(motion), budget_(budget), matrix_(problem),
      gradient_(problem.dof_count()), step_(problem.dof_count()), freedom_(motion ? problem.dof_count() : 0) {
}

namespace {

ObjectiveValue combine(const ObjectiveValue& a, const ObjectiveValue& b) {
    return {a.energy + b.energy, std::min(a.min_jacobian, b.min_jacobian)};
}

void accumulate(const HexValue& value, int count, ObjectiveValue& sum) {
    for (int i = 0; i < count; ++i) {
        sum.energy += value.energy[i];
        sum.min_jacobian = std::min(sum.min_jacobian, value.min_jacobian[i]);
    }
}

const ObjectiveValue kNothing = {0, std::numeric_limits<double>::infinity()};

} // namespace

ObjectiveValue Newton::evaluate_at(const Objective& objective, std::span<const Point> positions) const {
    return budget_.parallel().reduce(
        problem_.cell_count(), kEnergyChunk, kNothing,
        [&](std::size_t begin, std::size_t end) {
            ObjectiveValue sum = kNothing;
            HexValue value;
            for (std::size_t c = begin; c < end; c += kGroup) {
                const HexGroup g = group_of(problem_, objective, positions, c, std::min(end, c + kGroup));
                hex_kernels().value(g, value);
                accumulate(value, g.count, sum);
            }
            return sum;
        },
        combine);
}

std::vector<CellMeasure> measure_cells(const Problem& problem, std::span<const Point> positions,
                                       const Parallel& parallel) {
    std::vector<CellMeasure> result(problem.cell_count());
    parallel.for_chunks(result.size(), kEnergyChunk, [&](std::size_t begin, std::size_t end) {
        HexMeasure lanes;
        for (std::size_t c = begin; c < end; c += kGroup) {
            const HexGroup g = group_of(problem, {}, positions, c, std::min(end, c + kGroup));
            hex_kernels().measure(g, lanes);
            for (int i = 0; i < g.count; ++i)
                result[c + static_cast<std::size_t>(i)] = {
                    static_cast<float>(lanes.min_sj[i]), !(lanes.min_det8[i] > 0), !(lanes.min_det32[i] > 0)};
        }
    });
    return result;
}

ObjectiveValue Newton::compute_gradient(const Objective& objective) {
    std::fill(gradient_.begin(), gradient_.end(), Point(0));
    std::vector<ObjectiveValue> partial(problem_.cell_count() / kEnergyChunk + 1, kNothing);
    problem_.schedule().run(budget_.parallel(), [&](std::size_t begin, std::size_t end) {
        HexGradient cell;
        ObjectiveValue& sum = partial[begin / kEnergyChunk];
        for (std::size_t c = begin; c < end; c += kGroup) {
            const HexGroup g = group_of(problem_, objective, positions_, c, std::min(end, c + kGroup));
            hex_kernels().gradient(g, cell);
            accumulate(cell.value, g.count, sum);
            for (int i = 0; i < g.count; ++i)
                for (int k = 0; k < 8; ++k) {
                    const Point slope(cell.gradient[3 * k][i], cell.gradient[3 * k + 1][i],
                                      cell.gradient[3 * k + 2][i]);
                    for (DofShare share : problem_.shares(g.cells[i][k]))
                        gradient_[share.dof] += static_cast<double>(share.weight) * slope;
                }
        }
    });
    ObjectiveValue total = kNothing;
    for (const ObjectiveValue& part : partial) total = combine(total, part);
    return total;
}

void Newton::assemble(const Objective& objective) {
    matrix_.set_zero();
    problem_.schedule().run(budget_.parallel(), [&](std::size_t begin, std::size_t end) {
        HexHessian cell;
        for (std::size_t c = begin; c < end; c += kGroup) {
            const HexGroup g = group_of(problem_, objective, positions_, c, std::min(end, c + kGroup));
            hex_kernels().hessian(g, cell);
            for (int i = 0; i < g.count; ++i)
                matrix_.add_cell(c + static_cast<std::size_t>(i), &cell.block[0][i], kGroup);
        }
    });
}

/// Moves along step_ by the first of 1, 1/2, 1/4, ... that lowers the energy enough.
bool Newton::search_line(const Objective& objective, double slope, ObjectiveValue& value) {
    trial_ = positions_;
    const auto dofs = problem_.dof_vertex();
    double length = 1;
    for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
        budget_.parallel().for_each(dofs.size(), 1024, [&](std::size_t d) {
            const Point from = positions_[dofs[d]], wanted = from + length * step_[d];
            trial_[dofs[d]] = motion_ ? motion_->place(static_cast<Index>(d), from, wanted) : wanted;
        });
        problem_.apply_hanging(trial_);
        const ObjectiveValue at = evaluate_at(objective, trial_);
        if (at.energy <= value.energy + kArmijo * length * slope) {
            positions_.swap(trial_);
            value = at;
            return true;
        }
    }
    return false;
}

/// Takes the freedom of dofs whose full step ran into the end of their range; false if there is none.
bool Newton::pin_clamped() {
    if (!motion_) return false;
    bool pinned = false;
    const auto dofs = problem_.dof_vertex();
    for (std::size_t d = 0; d < dofs.size(); ++d) {
        const double length = glm::length(step_[d]);
        if (length == 0 || freedom_[d].kind == Freedom::none) continue;
        const Point from = positions_[dofs[d]], wanted = from + step_[d];
        if (glm::distance(motion_->place(static_cast<Index>(d), from, wanted), wanted) <
            kClampedFraction * length)
            continue;
        freedom_[d] = {Freedom::none, Point(0)};
        pinned = true;
    }
    return pinned;
}

/// One Newton step. Where vertices at the end of their range spoil it, they are held and the rest solved
/// again.
bool Newton::step_down(const Objective& objective, const NewtonOptions& options, ObjectiveValue& value,
                       int& cg_iterations) {
    for (int attempt = 0; attempt < kMaxPinnings; ++attempt) {
        const CgResult cg = solve_cg(matrix_, gradient_, freedom_, step_, options.cg_tolerance,
                                     options.cg_max_iterations, budget_.parallel());
        cg_iterations += cg.iterations;
        double slope = 0;
        for (std::size_t d = 0; d < step_.size(); ++d) slope -= glm::dot(gradient_[d], step_[d]);
        if (slope < 0 && search_line(objective, slope, value)) return true;
        if (!pin_clamped()) return false;
    }
    return false;
}

NewtonResult Newton::minimise(const Objective& objective, const NewtonOptions& options) {
    NewtonResult result;
    if (problem_.dof_count() == 0) {
        result.start = result.end = evaluate(objective);
        return result;
    }
    ObjectiveValue value = compute_gradient(objective);
    result.start = value;
    while (result.steps < options.max_steps && !budget_.exhausted()) {
        for (Point& g : gradient_) g = -g;
        if (motion_) motion_->freedoms(positions_, gradient_, freedom_);
        assemble(objective);
        const double before = value.energy;
        if (!step_down(objective, options, value, result.cg_iterations)) {
            result.stalled = true;
            break;
        }
        ++result.steps;
        budget_.spend_iteration();
        if (before - value.energy < options.min_relative_decrease * std::abs(before)) break;
        if (result.steps < options.max_steps) compute_gradient(objective);
    }
    result.end = value;
    return result;
}

} // namespace hexopt
