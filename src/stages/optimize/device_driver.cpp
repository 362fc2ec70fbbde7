#include "stages/optimize/device_driver.hpp"

#include "stages/optimize/max_min.hpp"
#include "stages/optimize/untangle.hpp"

#include <cmath>
#include <fmt/format.h>

namespace hexopt {

using compute::Backend;
using compute::Precision;

namespace {

constexpr double kStartEps = 0.05;
constexpr int kMaxRounds = 24, kMaxStalledRounds = 6;
/// Work of max-min (max_min::kWorkPerCell) that even a small mesh may take; less than on the host, whose
/// vectorised kernels are an order faster than a software device.
constexpr double kWorkAtLeast = 4e5;
constexpr double kRaiseMargin = 0.05, kRaiseGain = 0.03;
constexpr int kMaxIdleSweeps = 10, kMaxRaiseSweeps = 200;

enum class Phase { harmonic, untangle, raise_vertices, raise_neighbourhoods, done };

/// All that the run knows between two steps, on the host: it can go on from here on another backend.
struct Checkpoint {
    Phase phase = Phase::harmonic;
    std::vector<Point> positions;
    double eps = kStartEps;
    int rounds = 0, valid_rounds = 0, stalled_rounds = 0;
    int raise_sweeps = 0, idle_sweeps = 0;
    std::size_t strategy = 0;
    int tries_in_vain = 0;
    double work_left = 0; ///< of max-min, cells times Newton steps
};

/// A problem on the device with its solver.
struct Workspace {
    Workspace(const HexMesh& mesh, const Topology& topology, std::span<const std::uint8_t> movable)
        : problem(mesh, topology, movable) {}
    Status open(Backend& backend, Precision precision, std::span<const Point> positions) {
        auto created = DeviceProblem::create(backend, precision, problem, positions);
        if (!created) return created.error();
        device = std::make_unique<DeviceProblem>(std::move(*created));
        auto made = DeviceSolver::create(*device);
        if (!made) return made.error();
        solver = std::move(*made);
        return solver->update_lengths();
    }
    void close() {
        solver.reset();
        device.reset();
    }

    Problem problem;
    std::unique_ptr<DeviceProblem> device;
    std::unique_ptr<DeviceSolver> solver;
};

class DeviceRun {
  public:
    DeviceRun(const HexMesh& mesh, const Topology& topology, const OptimizeOptions& options,
              const DeviceTarget& target, std::vector<Point>& positions, Budget& budget,
              const std::function<void()>& keep_if_better, OptimizeStats& stats)
        : mesh_(mesh), topology_(topology), options_(options), target_(target), positions_(positions),
          budget_(budget), keep_if_better_(keep_if_better), stats_(stats), backend_(target.backend),
          movable_(interior(topology)), whole_(mesh, topology, movable_) {
        at_.positions = positions;
        at_.work_left =
            max_min::kWorkAtLeast + max_min::kWorkPerCell * static_cast<double>(mesh.cell_count());
    }

    Status run() {
        if (whole_.problem.dof_count() == 0) return Done{};
        while (at_.phase != Phase::done && !budget_.exhausted()) {
            const Status status = step();
            if (status) continue;
            if (!move_to_host(status.error())) return status;
        }
        finish();
        return Done{};
    }

  private:
    static std::vector<std::uint8_t> interior(const Topology& topology) {
        std::vector<std::uint8_t> movable(topology.on_boundary.size());
        for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = !topology.on_boundary[v];
        return movable;
    }

    /// One step of the current phase. On failure at_ is as it was.
    Status step() {
        if (at_.phase == Phase::raise_neighbourhoods) return raise_neighbourhoods();
        if (!whole_.solver)
            if (Status s = whole_.open(*backend_, target_.precision, at_.positions); !s) return s;
        switch (at_.phase) {
        case Phase::harmonic:
            return start_harmonic();
        case Phase::untangle:
            return untangle();
        default:
            return raise_vertices();
        }
    }

    /// Goes on without the device, if that can help.
    bool move_to_host(const Error& error) {
        const bool recoverable = error.code == ErrorCode::device || error.code == ErrorCode::out_of_memory;
        if (host_ || !recoverable) return false;
        whole_.close();
        host_ = compute::create_cpu_backend(budget_.parallel());
        backend_ = host_.get();
        const std::string note = error.one_line() + "; went on on the CPU from the last good state";
        stats_.notes.push_back(note);
        budget_.context().log(LogLevel::warning, note);
        return true;
    }

    /// Takes over the device's positions and the rest of the next checkpoint.
    Status accept(Checkpoint next) {
        if (Status s = whole_.device->download_positions(next.positions); !s) return s;
        at_ = std::move(next);
        positions_ = at_.positions;
        return Done{};
    }

    void finish() {
        positions_ = at_.positions;
        keep_if_better_();
    }

    Status start_harmonic() {
        budget_.context().report("untangle", 0.02);
        DeviceSolver& solver = *whole_.solver;
        Checkpoint next = at_;
        next.phase = Phase::untangle;
        const auto before = solver.measure();
        if (!before) return before.error();
        if (before->bad32 > 0) {
            if (Status s = solver.save(); !s) return s;
            const auto iterations = solver.harmonic_start(1e-8, 200);
            if (!iterations) return iterations.error();
            const auto after = solver.measure();
            if (!after) return after.error();
            if (!(after->bad32 < before->bad32))
                if (Status s = solver.restore(); !s) return s;
            stats_.cg_iterations += *iterations;
        }
        return accept(std::move(next));
    }

    Status untangle() {
        DeviceSolver& solver = *whole_.solver;
        Checkpoint next = at_;
        if (Status s = solver.update_lengths(); !s) return s;
        const Objective objective{at_.eps, 1, 0, 0};
        const auto start = solver.evaluate(objective);
        if (!start) return start.error();
        if (Status s = solver.sweep_newton(at_.eps, target_.sweeps_per_round); !s) return s;
        const auto newton = solver.minimise(objective, NewtonOptions{}, budget_);
        if (!newton) return newton.error();
        const ObjectiveValue end = newton->end;
        const double decrease = 1 - end.energy / start->energy;
        ++next.rounds;
        if (end.min_jacobian > 0) {
            next.stalled_rounds = 0;
            next.eps = target_.precision == Precision::f64 ? 1e-12 : 1e-6;
            if (++next.valid_rounds > 1 && decrease < 2e-3) next.phase = Phase::raise_vertices;
        } else {
            next.stalled_rounds = decrease < 1e-4 ? next.stalled_rounds + 1 : 0;
            if (next.stalled_rounds >= kMaxStalledRounds) next.phase = Phase::raise_vertices;
            next.eps =
                std::max(1e-9, std::min(0.2 * std::abs(end.min_jacobian),
                                        garanzha_eps(at_.eps, end.min_jacobian, start->energy, end.energy)));
        }
        if (next.rounds >= kMaxRounds) next.phase = Phase::raise_vertices;
        if (next.phase != Phase::untangle && !options_.max_min) next.phase = Phase::done;
        if (Status s = accept(std::move(next)); !s) return s;
        stats_.newton_steps += newton->steps;
        stats_.cg_iterations += newton->cg_iterations;
        stats_.sweeps += target_.sweeps_per_round;
        for (int i = 0; i < newton->steps + target_.sweeps_per_round; ++i) budget_.spend_iteration();
        budget_.context().report("untangle", 0.02 + 0.5 * at_.rounds / kMaxRounds,
                                 fmt::format("least J {:.2e}", end.min_jacobian));
        if (at_.phase != Phase::untangle) keep_if_better_();
        return Done{};
    }

    Status raise_vertices() {
        DeviceSolver& solver = *whole_.solver;
        Checkpoint next = at_;
        // Anew in every step, so that a run which goes on elsewhere does the same.
        if (Status s = solver.update_lengths(); !s) return s;
        const auto before = solver.measure();
        if (!before) return before.error();
        if (before->min_sj >= target()) {
            at_.phase = Phase::done;
            return Done{};
        }
        const auto moved = solver.sweep_raise(kRaiseMargin, kRaiseGain);
        if (!moved) return moved.error();
        const auto after = solver.measure();
        if (!after) return after.error();
        ++next.raise_sweeps;
        next.idle_sweeps = after->min_sj > before->min_sj + 1e-4 ? 0 : next.idle_sweeps + 1;
        if (*moved == 0 || next.idle_sweeps >= kMaxIdleSweeps || next.raise_sweeps >= kMaxRaiseSweeps ||
            after->min_sj >= target())
            next.phase = Phase::raise_neighbourhoods;
        if (Status s = accept(std::move(next)); !s) return s;
        ++stats_.sweeps;
        budget_.spend_iteration();
        budget_.context().report("max-min", 0.6, fmt::format("min SJ {:.4f}", after->min_sj));
        if (at_.phase != Phase::raise_vertices) {
            keep_if_better_();
            whole_.close();
        }
        return Done{};
    }

    double target() const { return std::min(options_.min_sj, max_min::kPerfect); }
    const max_min::Strategy& strategy() const { return max_min::kStrategies[at_.strategy]; }

    /// One attempt: Newton on the worst cells and kRings rings around them, with a penalty on corners below a
    /// threshold.
    Status raise_neighbourhoods() {
        Checkpoint next = at_;
        std::vector<Index> seeds;
        double before = 0;
        if (Status s = find_seeds(seeds, before); !s) return s;
        constexpr int kStrategies = static_cast<int>(std::size(max_min::kStrategies));
        if (before >= target() || at_.tries_in_vain >= kStrategies || !(at_.work_left > 0)) {
            next.phase = Phase::done;
            at_ = std::move(next);
            return Done{};
        }
        const auto moving = movable_neighbourhood(mesh_, topology_, movable_, seeds, max_min::kRings);
        Workspace part(mesh_, topology_, moving);
        double after = before;
        if (part.problem.dof_count() > 0)
            if (Status s = attempt(part, before + strategy().rise + max_min::kMargin, next, after); !s)
                return s;
        if (after - before > max_min::kWorthwhile) {
            next.tries_in_vain = 0;
        } else {
            ++next.tries_in_vain;
            next.strategy = (at_.strategy + 1) % std::size(max_min::kStrategies);
        }
        at_ = std::move(next);
        positions_ = at_.positions;
        budget_.context().report("max-min", 0.8, fmt::format("min SJ {:.4f}", after));
        return Done{};
    }

    /// Cells whose scaled Jacobian is below the next threshold, and the least of all.
    Status find_seeds(std::vector<Index>& seeds, double& least) {
        if (!whole_.solver) {
            if (Status s = whole_.open(*backend_, target_.precision, at_.positions); !s) return s;
        } else {
            if (Status s = whole_.device->upload_positions(at_.positions); !s) return s;
            if (Status s = whole_.solver->update_lengths(); !s) return s;
        }
        const auto cells = whole_.solver->measure_cells();
        if (!cells) return cells.error();
        least = *std::min_element(cells->begin(), cells->end());
        for (std::size_t i = 0; i < cells->size(); ++i)
            if ((*cells)[i] < least + strategy().rise + max_min::kMargin)
                seeds.push_back(whole_.problem.cell_id()[i]);
        return Done{};
    }

    Status attempt(Workspace& part, double theta, Checkpoint& next, double& after_sj) {
        if (Status s = part.open(*backend_, target_.precision, at_.positions); !s) return s;
        const auto before = part.solver->measure();
        if (!before) return before.error();
        NewtonOptions options;
        options.max_steps = 15;
        const auto newton = part.solver->minimise(
            {at_.eps, strategy().shape_weight, max_min::kPenaltyWeight, theta}, options, budget_);
        if (!newton) return newton.error();
        const auto after = part.solver->measure();
        if (!after) return after.error();
        const bool better =
            after->min_sj > before->min_sj && after->bad8 <= before->bad8 && after->bad32 <= before->bad32;
        if (better) {
            if (Status s = part.device->download_positions(next.positions); !s) return s;
            after_sj = after->min_sj;
        }
        stats_.newton_steps += newton->steps;
        stats_.cg_iterations += newton->cg_iterations;
        for (int i = 0; i < newton->steps; ++i) budget_.spend_iteration();
        return Done{};
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    const OptimizeOptions& options_;
    const DeviceTarget& target_;
    std::vector<Point>& positions_;
    Budget& budget_;
    const std::function<void()>& keep_if_better_;
    OptimizeStats& stats_;
    std::unique_ptr<Backend> host_; ///< once the device has failed
    Backend* backend_;
    std::vector<std::uint8_t> movable_;
    Workspace whole_;
    Checkpoint at_;
};

} // namespace

Status optimize_on_device(const HexMesh& mesh, const Topology& topology, const OptimizeOptions& options,
                          const DeviceTarget& target, std::vector<Point>& positions, Budget& budget,
                          const std::function<void()>& keep_if_better, OptimizeStats& stats) {
    return DeviceRun(mesh, topology, options, target, positions, budget, keep_if_better, stats).run();
}

} // namespace hexopt
