#include "stages/optimize/max_min.hpp"

#include <fmt/format.h>
#include <optional>

namespace hexopt {

namespace {

constexpr double kValidEps = 1e-12;
constexpr int kMaxNarrowings = 4;
constexpr float kNarrower = 0.8f;

struct Worst {
    double min_sj = 2;
    std::size_t bad8 = 0, bad32 = 0;
    bool is_better_than(const Worst& other) const {
        return bad8 <= other.bad8 && bad32 <= other.bad32 && min_sj > other.min_sj;
    }
};

Worst summarise(const std::vector<CellMeasure>& cells) {
    Worst worst;
    for (const CellMeasure& cell : cells) {
        worst.min_sj = std::min(worst.min_sj, static_cast<double>(cell.min_sj));
        worst.bad8 += cell.has_bad8;
        worst.bad32 += cell.has_bad32;
    }
    return worst;
}

} // namespace

std::vector<std::uint8_t> movable_neighbourhood(const HexMesh& mesh, const Topology& topology,
                                                std::span<const std::uint8_t> movable,
                                                std::span<const Index> seeds, int rings) {
    std::vector<std::uint8_t> cell_in(mesh.cell_count(), 0), vertex_in(mesh.vertex_count(), 0);
    std::vector<Index> front(seeds.begin(), seeds.end()), next;
    for (Index c : front) cell_in[c] = 1;
    for (int ring = 0; ring < rings; ++ring) {
        next.clear();
        for (Index c : front)
            for (Index v : mesh.cells[c]) {
                if (vertex_in[v]) continue;
                vertex_in[v] = 1;
                for (CellCorner corner : topology.vertex_cell[v])
                    if (!cell_in[corner.cell]) cell_in[corner.cell] = 1, next.push_back(corner.cell);
            }
        front.swap(next);
    }
    // What hangs follows its masters, which therefore belong to the neighbourhood.
    if (const Hanging& hanging = mesh.hanging; !hanging.empty())
        for (std::size_t row = 0; row < hanging.count(); ++row)
            if (vertex_in[hanging.vertex[row]])
                for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                    vertex_in[hanging.master[k]] = 1;
    for (std::size_t v = 0; v < vertex_in.size(); ++v) vertex_in[v] = vertex_in[v] && movable[v];
    return vertex_in;
}

std::vector<Index> open_bands(const Movement& movement, std::span<const Index> cells) {
    std::vector<Index> opened;
    if (!(movement.band > 0)) return opened;
    const auto bound = movement.surface->associations();
    const auto open = [&](Index v) {
        if (bound[v].kind == EntityKind::interior || bound[v].kind == EntityKind::hanging) return;
        if (movement.limits->band[v] > 0) return;
        movement.limits->band[v] = static_cast<float>(movement.band) * movement.limits->band_share[v];
        opened.push_back(v);
    };
    for (Index c : cells)
        for (Index v : movement.mesh->cells[c])
            for (CellCorner corner : movement.topology->vertex_cell[v])
                for (Index w : movement.mesh->cells[corner.cell]) open(w);
    return opened;
}

namespace {

class MaxMin {
  public:
    MaxMin(Movement& movement, Engine& engine, std::vector<Point>& positions, double eps, double work,
           Budget& budget)
        : movement_(movement), engine_(engine), positions_(positions), eps_(eps), work_left_(work),
          budget_(budget) {
        Problem whole(*movement.mesh, *movement.topology, movement.movable, movement.tets,
                      movement.inverse_stretch, budget.parallel());
        whole.update_lengths(positions, budget.parallel());
        cell_id_.assign(whole.cell_id().begin(), whole.cell_id().end());
        measure_ = measure_cells(whole, positions, budget.parallel());
        place_.assign(movement.mesh->cell_count(), kNoIndex);
        for (Index i = 0; i < cell_id_.size(); ++i) place_[cell_id_[i]] = i;
    }

    MaxMinResult run(double wanted, RaiseOrder order) {
        const double spent_before = work_spent_;
        MaxMinResult result = raise(wanted, order);
        result.work = work_spent_ - spent_before;
        return result;
    }

  private:
    MaxMinResult raise(double wanted, RaiseOrder order) {
        const double target = std::min(wanted, max_min::kPerfect);
        MaxMinResult result;
        result.min_sj_before = result.min_sj_after = summarise(measure_).min_sj;
        if (order != RaiseOrder::worst && engine_.takes_parts()) {
            const double work = work_left_;
            const bool all = raise_parts(target, result);
            result.min_sj_after = summarise(measure_).min_sj;
            if (order == RaiseOrder::parts_first)
                work_left_ = work;
            else if (!all)
                return result;
        }
        int tries_in_vain = 0;
        std::size_t strategy = 0;
        while (tries_in_vain < static_cast<int>(std::size(max_min::kStrategies)) &&
               result.min_sj_after < target && work_left_ > 0 && !budget_.exhausted()) {
            ++result.rounds;
            const double before = result.min_sj_after;
            const max_min::Strategy& how = max_min::kStrategies[strategy];
            if (attempt(before + how.rise, how.shape_weight, result))
                result.min_sj_after = summarise(measure_).min_sj;
            budget_.context().log(LogLevel::debug,
                                  fmt::format("max-min {}: min SJ {:.4f} -> {:.4f} with rise {}, weight "
                                              "{:.0e}, {} cells, {} steps, {} cg",
                                              result.rounds, before, result.min_sj_after, how.rise,
                                              how.shape_weight, attempt_cells_, result.newton_steps,
                                              result.cg_iterations));
            if (result.min_sj_after - before > max_min::kWorthwhile) {
                tries_in_vain = 0;
                continue;
            }
            ++tries_in_vain;
            strategy = (strategy + 1) % std::size(max_min::kStrategies);
        }
        return result;
    }

    /// What is raised together.
    struct Local {
        Problem problem;
        std::optional<SurfaceMotion> motion;
        std::unique_ptr<Minimiser> minimiser;
        std::vector<Point> saved;  ///< per dof: before the attempt
        std::vector<Index> opened; ///< bands

        Local(Problem taken, std::vector<Index> bands)
            : problem(std::move(taken)), opened(std::move(bands)) {}
    };

    void open(Local& local) {
        if (movement_.surface)
            local.motion.emplace(local.problem, *movement_.surface, *movement_.limits, movement_.tangents,
                                 movement_.faces);
        local.minimiser = engine_.open(local.problem, positions_, local.motion ? &*local.motion : nullptr);
        local.minimiser->update_lengths();
        attempt_cells_ = local.problem.cell_count();
    }

    /// Cells below a threshold.
    std::vector<Index> find_seeds(double below) const {
        std::vector<Index> seeds;
        for (std::size_t i = 0; i < measure_.size(); ++i)
            if (is_below(measure_[i], below)) seeds.push_back(cell_id_[i]);
        return seeds;
    }

    static bool is_below(const CellMeasure& cell, double level) {
        return cell.min_sj < level || cell.has_bad32;
    }

    Problem make_problem(std::span<const Index> seeds) const {
        const auto moving = movable_neighbourhood(*movement_.mesh, *movement_.topology, movement_.movable,
                                                  seeds, max_min::kRings);
        return Problem(*movement_.mesh, *movement_.topology, moving, movement_.tets,
                       movement_.inverse_stretch, budget_.parallel());
    }

    bool attempt(double theta, double shape_weight, MaxMinResult& result) {
        const std::vector<Index> seeds = find_seeds(theta + max_min::kMargin);
        std::vector<Index> opened = open_bands(movement_, seeds);
        Local local(make_problem(seeds), std::move(opened));
        open(local);
        return raise(local, theta, shape_weight, eps_, result);
    }

    bool raise(Local& local, double theta, double shape_weight, double eps, MaxMinResult& result) {
        const Problem& problem = local.problem;
        local.saved.assign(problem.dof_count(), Point(0));
        for (std::size_t d = 0; d < local.saved.size(); ++d)
            local.saved[d] = positions_[problem.dof_vertex()[d]];
        const Worst before = summarise(local.minimiser->measure());
        for (int narrowing = 0; narrowing < kMaxNarrowings && problem.dof_count() > 0; ++narrowing) {
            if (narrowing > 0)
                local.motion.emplace(problem, *movement_.surface, *movement_.limits, movement_.tangents,
                                     movement_.faces);
            minimise_penalty(*local.minimiser, theta, shape_weight, eps, result);
            const std::vector<Index> violators = find_violators(problem);
            if (!violators.empty())
                movement_.guard->tighten(positions_, violators, kNarrower, *movement_.limits);
            const bool is_last = narrowing + 1 == kMaxNarrowings;
            if (!violators.empty() && !is_last) continue;
            return accept(local, before, !violators.empty()) || give_up(local);
        }
        return give_up(local);
    }

    bool give_up(const Local& local) {
        for (std::size_t d = 0; d < local.saved.size(); ++d)
            positions_[local.problem.dof_vertex()[d]] = local.saved[d];
        local.problem.apply_hanging(positions_);
        for (Index v : local.opened) movement_.limits->band[v] = 0;
        return false;
    }

    /// Parts that share no cells rise one by one, to one level after the other: what cannot rise in one place
    /// does not stop the others. False: some parts could not.
    bool raise_parts(double target, MaxMinResult& result) {
        std::vector<std::uint8_t> stuck(cell_id_.size(), 0);
        bool all = true;
        for (double level : max_min::kLevels) {
            std::vector<Index> seeds = find_seeds(std::min(level, target));
            std::erase_if(seeds, [&](Index c) { return stuck[place_[c]] != 0; });
            for (Problem& part : Problem::split(make_problem(seeds))) {
                const std::vector<Index> cells(part.cell_id().begin(), part.cell_id().end());
                if (work_left_ <= 0 || budget_.exhausted()) return all;
                if (raise_part(std::move(part), std::min(level, target), result)) continue;
                all = false;
                for (Index c : cells)
                    if (is_below(measure_[place_[c]], level)) stuck[place_[c]] = 1;
            }
            budget_.context().log(LogLevel::debug,
                                  fmt::format("max-min to {}: {} cells below, {} steps, {} cg", level,
                                              seeds.size(), result.newton_steps, result.cg_iterations));
            if (level >= target) break;
        }
        return all;
    }

    std::vector<Index> find_low(const Problem& part, double level) const {
        std::vector<Index> low;
        for (Index c : part.cell_id())
            if (is_below(measure_[place_[c]], level)) low.push_back(c);
        return low;
    }

    /// False: it stays below the level.
    bool raise_part(Problem part, double level, MaxMinResult& result) {
        std::vector<Index> opened = open_bands(movement_, find_low(part, level));
        Local local(std::move(part), std::move(opened));
        double least = min_in(local.problem);
        if (least < 0) return false; // not for max-min to mend
        open(local);
        for (const max_min::Strategy& how : max_min::kStrategies)
            for (double before = -1; least < level && least - before > max_min::kWorthwhile;) {
                if (work_left_ <= 0 || budget_.exhausted()) return false;
                before = least;
                raise(local, std::min(least + how.rise, level), how.shape_weight, kValidEps, result);
                least = min_in(local.problem);
            }
        return least >= level;
    }

    /// Least scaled Jacobian, -1 where a cell is bad.
    double min_in(const Problem& problem) const {
        double least = 1;
        for (Index c : problem.cell_id()) {
            const CellMeasure& cell = measure_[place_[c]];
            least = std::min(least, cell.has_bad32 ? -1.0 : double(cell.min_sj));
        }
        return least;
    }

    /// Keeps where the dofs have got to, or a half or a quarter of the way there, if that is better and no
    /// quad deviates too far. violates: some do at the end of the way.
    bool accept(Local& local, const Worst& before, bool violates) {
        const Problem& problem = local.problem;
        reached_.resize(problem.dof_count());
        for (std::size_t d = 0; d < reached_.size(); ++d) reached_[d] = positions_[problem.dof_vertex()[d]];
        std::vector<CellMeasure> after;
        for (double share = violates ? 0.5 : 1; share >= 0.25; share *= 0.5) {
            if (share < 1) go_share_of_way(local, local.motion ? &*local.motion : nullptr, share);
            after = local.minimiser->measure();
            if (!summarise(after).is_better_than(before)) continue;
            if (share < 1 && !find_violators(problem).empty()) continue;
            for (std::size_t i = 0; i < after.size(); ++i) measure_[place_[problem.cell_id()[i]]] = after[i];
            return true;
        }
        go_share_of_way(local, nullptr, 1);
        return false;
    }

    void go_share_of_way(const Local& local, const Motion* motion, double share) {
        const Problem& problem = local.problem;
        for (Index d = 0; d < reached_.size(); ++d) {
            const Point wanted = local.saved[d] + share * (reached_[d] - local.saved[d]);
            positions_[problem.dof_vertex()[d]] = motion ? motion->place(d, wanted) : wanted;
        }
        problem.apply_hanging(positions_);
    }

    std::vector<Index> find_violators(const Problem& problem) const {
        if (!movement_.guard) return {};
        return movement_.guard->violators(positions_, problem.dof_vertex(), budget_.parallel());
    }

    void minimise_penalty(Minimiser& newton, double theta, double shape_weight, double eps,
                          MaxMinResult& result) {
        NewtonOptions options;
        // What a step costs with its conjugate gradients, so that the last attempt keeps to the budget too.
        const double step_work = 2.5 * static_cast<double>(newton.problem().cell_count());
        options.max_steps = std::clamp(static_cast<int>(work_left_ / step_work), 2, 15);
        options.cg_tolerance = 1e-4;
        options.min_relative_decrease = 1e-6; // the shape energy of a large neighbourhood dwarfs the penalty
        const NewtonResult step =
            newton.minimise({eps, shape_weight, max_min::kPenaltyWeight, theta + max_min::kMargin}, options);
        result.newton_steps += step.steps;
        result.cg_iterations += step.cg_iterations;
        const double work = static_cast<double>(newton.problem().cell_count()) *
                            (1 + step.steps + max_min::kWorkPerCgIteration * step.cg_iterations);
        work_left_ -= work;
        work_spent_ += work;
    }

    Movement& movement_;
    Engine& engine_;
    std::vector<Point>& positions_;
    double eps_, work_left_, work_spent_ = 0;
    Budget& budget_;
    std::vector<Index> cell_id_, place_;
    std::size_t attempt_cells_ = 0;
    std::vector<CellMeasure> measure_;
    std::vector<Point> reached_; ///< per dof of the attempt
};

} // namespace

MaxMinResult raise_worst_cells(Movement& movement, Engine& engine, std::vector<Point>& positions, double eps,
                               double target, double work, RaiseOrder order, Budget& budget) {
    return MaxMin(movement, engine, positions, eps, work, budget).run(target, order);
}

} // namespace hexopt
