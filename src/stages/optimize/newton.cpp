#include "stages/optimize/newton.hpp"

#include "stages/optimize/untangle.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace hexopt {

namespace {

constexpr std::size_t kEnergyChunk = 256;
constexpr std::size_t kCellChunk = 256;
constexpr int kMaxHalvings = 12;
constexpr double kArmijo = 1e-4;
/// A step is blocked where, halved so many times, less of its slope is left than this share.
constexpr int kFirstBlockTest = 2;
constexpr double kLeastShareOfSlope = 0.3;
/// Of a dof's step that its entity does not let through, for which it is held.
constexpr double kBlockedShare = 0.3;
constexpr int kMaxHolds = 4;

HexGroup group_of(const Problem& problem, const Objective& objective, std::span<const Point> positions,
                  std::size_t begin, std::size_t end) {
    return {positions.data(),
            problem.mesh().cells.data(),
            &problem.inverse_length()[begin],
            &problem.weight()[begin],
            &problem.tet_mask()[begin],
            static_cast<int>(end - begin),
            objective.eps,
            objective.shape_weight,
            objective.penalty_weight,
            objective.theta,
            &problem.cell_id()[begin],
            problem.inverse_stretch(),
            objective.size_weight};
}

} // namespace

Newton::Newton(Problem& problem, std::vector<Point>& positions, const Motion* motion, Budget& budget)
    : problem_(problem), positions_(positions), motion_(motion), budget_(budget), matrix_(problem),
      schedule_(problem.cell_dof(), problem.dof_count(), kCellChunk), gradient_(problem.dof_count()),
      step_(problem.dof_count()), freedom_(motion ? motion->on_surface().size() : 0) {
    problem.release_cell_dof();
}

namespace {

ObjectiveValue combine(const ObjectiveValue& a, const ObjectiveValue& b) {
    return {a.energy + b.energy, std::min(a.min_jacobian, b.min_jacobian)};
}

/// Returns the energy of the group.
double accumulate(const HexValue& value, int count, ObjectiveValue& sum) {
    double energy = 0;
    for (int i = 0; i < count; ++i) {
        sum.energy += value.energy[i];
        energy += value.energy[i];
        sum.min_jacobian = std::min(sum.min_jacobian, value.min_jacobian[i]);
    }
    return energy;
}

const ObjectiveValue kNothing = {0, std::numeric_limits<double>::infinity()};

} // namespace

Newton::Evaluation Newton::evaluate_at(const Objective& objective, std::span<const Point> positions,
                                       double most) const {
    Evaluation total = budget_.parallel().reduce(
        problem_.cell_count(), kEnergyChunk, Evaluation{kNothing},
        [&](std::size_t begin, std::size_t end) {
            Evaluation sum{kNothing};
            HexValue value;
            for (std::size_t c = begin; c < end && !(sum.value.energy > most); c += kGroup) {
                const HexGroup g = group_of(problem_, objective, positions, c, std::min(end, c + kGroup));
                hex_kernels().value(g, value);
                if (const double energy = accumulate(value, g.count, sum.value); energy > sum.largest)
                    sum.largest = energy, sum.first = c;
            }
            return sum;
        },
        [](const Evaluation& a, const Evaluation& b) {
            const Evaluation& larger = b.largest > a.largest ? b : a;
            return Evaluation{combine(a.value, b.value), larger.largest, larger.first};
        });
    // Never negative, and dear: vertices off the surface are projected onto it.
    if (total.value.energy <= most) total.value.energy += limit_energy(objective, positions);
    return total;
}

double Newton::limit_energy(const Objective& objective, std::span<const Point> positions) const {
    if (!motion_) return 0;
    const auto limited = motion_->limited();
    return limit_weight(objective) *
           (motion_->face_energy(positions) +
            budget_.parallel().reduce(
                limited.size(), kEnergyChunk, 0.0,
                [&](std::size_t begin, std::size_t end) {
                    double sum = 0;
                    for (std::size_t i = begin; i < end; ++i)
                        sum +=
                            motion_->limit(limited[i], positions[problem_.dof_vertex()[limited[i]]]).energy;
                    return sum;
                },
                std::plus<>()));
}

void Newton::add_limit_gradient(const Objective& objective) {
    if (!motion_) return;
    for (Index d : motion_->limited())
        gradient_[d] +=
            limit_weight(objective) * motion_->limit(d, positions_[problem_.dof_vertex()[d]]).gradient;
    face_terms_.clear();
    motion_->append_face_terms(positions_, face_terms_);
    for (const FaceTerm& face : face_terms_)
        for (std::size_t k = 0; k < 4; ++k)
            for (DofShare share : problem_.shares(problem_.cell(face.cell)[face.corner[k]]))
                gradient_[share.dof] += limit_weight(objective) * face.weight[k] *
                                        static_cast<double>(share.weight) * face.limit.gradient;
}

void Newton::add_limit_hessian(const Objective& objective) {
    if (!motion_) return;
    for (Index d : motion_->limited())
        matrix_.add_diagonal(d, limit_weight(objective) *
                                    motion_->limit(d, positions_[problem_.dof_vertex()[d]]).hessian);
    std::vector<float> block;
    for (const FaceTerm& face : face_terms_) { // those of the gradient, which is of the same place
        block.assign(sizeof(HexHessian::block) / sizeof(HexHessian::block[0]), 0);
        for (std::size_t k = 0; k < 4; ++k)
            for (std::size_t l = 0; l < 4; ++l) {
                const int i = face.corner[k], j = face.corner[l];
                if (i > j) continue;
                float* to = &block[9 * static_cast<std::size_t>(hessian_block(i, j))];
                const double weight = limit_weight(objective) * face.weight[k] * face.weight[l];
                for (int e = 0; e < 9; ++e)
                    to[e] += static_cast<float>(weight * face.limit.hessian[e / 3][e % 3]);
            }
        matrix_.add_cell(face.cell, block.data(), 1);
    }
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

std::vector<CellMeasure> Newton::measure() { return measure_cells(problem_, positions_, budget_.parallel()); }

int Newton::start_harmonically(std::span<const std::uint8_t> on_boundary) {
    return harmonic_start(*this, on_boundary, budget_);
}

std::unique_ptr<Minimiser> HostEngine::open(Problem& problem, std::vector<Point>& positions,
                                            const SurfaceMotion* motion) {
    return std::make_unique<Newton>(problem, positions, motion, budget_);
}

ObjectiveValue Newton::compute_gradient(const Objective& objective) {
    std::fill(gradient_.begin(), gradient_.end(), Point(0));
    std::vector<ObjectiveValue> partial(problem_.cell_count() / kEnergyChunk + 1, kNothing);
    schedule_.run(budget_.parallel(), [&](std::size_t begin, std::size_t end) {
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
                    for (DofShare share : problem_.shares(problem_.cell(c + static_cast<std::size_t>(i))[k]))
                        gradient_[share.dof] += static_cast<double>(share.weight) * slope;
                }
        }
    });
    ObjectiveValue total = kNothing;
    for (const ObjectiveValue& part : partial) total = combine(total, part);
    total.energy += limit_energy(objective, positions_);
    add_limit_gradient(objective);
    return total;
}

void Newton::assemble(const Objective& objective) {
    matrix_.set_zero();
    schedule_.run(budget_.parallel(), [&](std::size_t begin, std::size_t end) {
        HexHessian cell;
        for (std::size_t c = begin; c < end; c += kGroup) {
            const HexGroup g = group_of(problem_, objective, positions_, c, std::min(end, c + kGroup));
            hex_kernels().hessian(g, cell);
            for (int i = 0; i < g.count; ++i)
                matrix_.add_cell(c + static_cast<std::size_t>(i), &cell.block[0][i], kGroup);
        }
    });
    add_limit_hessian(objective);
}

/// Moves along step_ by the first of 1, 1/2, 1/4, ... that lowers the energy enough.
Newton::Search Newton::search_line(const Objective& objective, double slope, ObjectiveValue& value) {
    const auto dofs = problem_.dof_vertex();
    const auto rows = problem_.hanging_rows();
    const auto hanging = [&](std::size_t i) { return problem_.mesh().hanging.vertex[rows[i]]; };
    start_.resize(dofs.size() + rows.size());
    for (std::size_t d = 0; d < dofs.size(); ++d) start_[d] = positions_[dofs[d]];
    for (std::size_t i = 0; i < rows.size(); ++i) start_[dofs.size() + i] = positions_[hanging(i)];
    double length = 1;
    const auto place = [&](std::size_t d) {
        const Point wanted = start_[d] + length * step_[d];
        positions_[dofs[d]] = motion_ ? motion_->place(static_cast<Index>(d), wanted) : wanted;
    };
    Search result = Search::stalled;
    for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
        const double most = value.energy + kArmijo * length * slope;
        for (Index d : barrier_.dofs) place(d);
        problem_.apply_hanging(positions_, barrier_.hanging_rows);
        const bool is_refused = barrier_energy(objective) > most;
        const bool may_be_blocked = motion_ && motion_->has_exact_freedoms() && halving >= kFirstBlockTest;
        if (is_refused && !may_be_blocked) continue;
        budget_.parallel().for_each(dofs.size(), 1024, [&](std::size_t d) {
            if (barrier_.has_dof.empty() || !barrier_.has_dof[d]) place(d);
        });
        problem_.apply_hanging(positions_);
        if (!is_refused) {
            const Evaluation at = evaluate_at(objective, positions_, most);
            if (at.value.energy <= most) {
                value = at.value;
                return Search::moved;
            }
            stand_before(at.first);
        }
        if (may_be_blocked && is_blocked(length, slope)) {
            hold_blocked(length);
            result = Search::blocked;
            break;
        }
    }
    for (std::size_t d = 0; d < dofs.size(); ++d) positions_[dofs[d]] = start_[d];
    for (std::size_t i = 0; i < rows.size(); ++i) positions_[hanging(i)] = start_[dofs.size() + i];
    return result;
}

/// Makes the group of cells from first_cell on the one that is looked at first.
void Newton::stand_before(std::size_t first_cell) {
    if (first_cell == barrier_.first && barrier_.last > first_cell) return;
    for (Index d : barrier_.dofs) barrier_.has_dof[d] = 0;
    barrier_.has_dof.resize(problem_.dof_count(), 0);
    barrier_.dofs.clear();
    barrier_.hanging_rows.clear();
    barrier_.first = first_cell;
    barrier_.last = std::min(first_cell + kGroup, problem_.cell_count());
    for (std::size_t c = barrier_.first; c < barrier_.last; ++c)
        for (Index v : problem_.cell(c)) {
            const auto shares = problem_.shares(v);
            for (DofShare share : shares)
                if (!std::exchange(barrier_.has_dof[share.dof], std::uint8_t{1}))
                    barrier_.dofs.push_back(share.dof);
            if (!shares.empty() && problem_.vertex_dof(v) == kNoIndex)
                barrier_.hanging_rows.push_back(problem_.hanging_row(v));
        }
}

double Newton::barrier_energy(const Objective& objective) const {
    if (barrier_.last == barrier_.first) return 0;
    const HexGroup g = group_of(problem_, objective, positions_, barrier_.first, barrier_.last);
    HexValue value;
    hex_kernels().value(g, value);
    ObjectiveValue sum = kNothing;
    return accumulate(value, g.count, sum);
}

/// Whether what the entities let through of the step would not lower the energy as it was meant to.
bool Newton::is_blocked(double length, double slope) const {
    const auto dofs = problem_.dof_vertex();
    double got = 0;
    for (std::size_t d = 0; d < dofs.size(); ++d)
        got -= glm::dot(gradient_[d], positions_[dofs[d]] - start_[d]);
    return got > kLeastShareOfSlope * length * slope;
}

/// Takes from the dofs that their entity did not let go where they wanted the direction in which it did not.
void Newton::hold_blocked(double length) {
    const auto dofs = problem_.dof_vertex();
    for (std::size_t i = 0; i < freedom_.size(); ++i) {
        const Index d = motion_->on_surface()[i];
        Freedom& freedom = freedom_[i];
        if (freedom.kind != Freedom::plane && freedom.kind != Freedom::line) continue;
        const Point wanted = length * step_[d], got = positions_[dofs[d]] - start_[d];
        const double size = glm::length(wanted), went = glm::length(got);
        if (!(glm::distance(wanted, got) > kBlockedShare * size)) continue;
        const bool goes_along = freedom.kind == Freedom::plane && went > kBlockedShare * size;
        freedom = goes_along ? Freedom{Freedom::line, got / went} : Freedom{Freedom::none, Point(0)};
    }
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
        if (motion_) motion_->freedoms(positions_, freedom_);
        assemble(objective);
        for (Point& g : gradient_) g = -g;
        const double before = value.energy;
        Search search = Search::blocked;
        for (int hold = 0; hold <= kMaxHolds && search == Search::blocked; ++hold) {
            start_ = std::vector<Point>(); // not while the linear solver needs as much
            const HeldDofs held{motion_ ? motion_->on_surface() : std::span<const Index>{}, freedom_};
            const CgResult cg = solve_cg(matrix_, gradient_, held, step_, options.cg_tolerance,
                                         options.cg_max_iterations, budget_.parallel());
            result.cg_iterations += cg.iterations;
            double slope = 0;
            for (std::size_t d = 0; d < step_.size(); ++d) slope -= glm::dot(gradient_[d], step_[d]);
            search = slope < 0 ? search_line(objective, slope, value) : Search::stalled;
        }
        if (search != Search::moved) {
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
