#include "pipeline/rescue_mesh.hpp"

#include "pipeline/repair_cells.hpp"

#include <fmt/format.h>

namespace hexopt {

namespace {

/// Rings of octree cells refined round what fails, in turn.
constexpr int kRescueRings[] = {1, 3};

class Rescue {
  public:
    Rescue(MeshState& state, const Domain& whole, Domain& domain, const MeshOptions& options,
           const ComputePlace& place, StageClock& clock, Context& context)
        : state_(state), whole_(whole), domain_(domain), options_(options), place_(place), clock_(clock),
          context_(context) {}

    Status run() {
        for (int rings : kRescueRings)
            if (is_due() && refine_round_failures(rings))
                if (Status done = mesh_again(options_); !done) return done;
        if (is_due() && state_.best->buffer) {
            MeshOptions bare = options_;
            bare.buffers = false;
            if (Status done = mesh_again(bare); !done) return done;
        }
        state_.octree.put_away();
        bind_surface(domain_, state_.best->fitted); // the last one need not be the best
        return Done{};
    }

  private:
    bool is_due() const {
        return state_.best->stats && !state_.best->failed.empty() &&
               state_.counts.optimize_s_left(options_) > 0;
    }

    bool refine_round_failures(int rings) {
        const MeshAttempt& best = *state_.best;
        RefineOutput& refined = state_.octree.open(context_);
        const auto near = find_cells_round(refined.octree, best.fitted.mesh, best.failed, rings);
        if (!state_.may_refine(near.size())) return false;
        refined.max_cells = options_.refine.max_cells;
        const RefineCount count = refine_cells(refined, near, context_);
        state_.attempts.back().refined = count.requested;
        return count.requested > 0;
    }

    /// Errors that only the new attempt has leave the best one as it is.
    Status mesh_again(const MeshOptions& options) {
        SettleReport report;
        auto next = try_again(options, report);
        if (!next && next.error().code == ErrorCode::out_of_memory) return next.error();
        if (context_.is_cancelled()) {
            state_.best->stats.reset();
            return Done{};
        }
        if (!next) {
            context_.log(LogLevel::warning, "a rescue is left out: " + next.error().one_line());
            return Done{};
        }
        state_.attempts.push_back({next->fitted.mesh.cell_count(), next->failed.size(), 0});
        context_.log(LogLevel::debug,
                     fmt::format("rescue {} layers: {} of {} cells fail, {} before",
                                 next->buffer ? "with" : "without", next->failed.size(),
                                 next->fitted.mesh.cell_count(), state_.best->failed.size()));
        if (next->failed.size() < state_.best->failed.size()) {
            state_.best = std::move(*next);
            state_.settle = std::move(report);
        }
        return Done{};
    }

    Result<MeshAttempt> try_again(const MeshOptions& options, SettleReport& report) {
        auto next =
            begin_attempt(state_.octree, whole_, domain_, options, state_.counts, clock_, context_, nullptr);
        if (!next) return next;
        if (Status done = optimize_attempt(*next, std::nullopt, domain_, options, place_, state_.counts,
                                           clock_, context_);
            !done)
            return done.error();
        next->dropped = state_.best->dropped;
        if (!next->stats) return make_error(ErrorCode::cancelled, "settle", "", "cancelled");
        if (Status done = settle_attempt(*next, domain_, options, state_.counts, report, clock_, context_);
            !done)
            return done.error();
        return next;
    }

    MeshState& state_;
    const Domain& whole_;
    Domain& domain_;
    const MeshOptions& options_;
    const ComputePlace& place_;
    StageClock& clock_;
    Context& context_;
};

} // namespace

Status settle_attempt(MeshAttempt& attempt, Domain& domain, const MeshOptions& options, AttemptCounts& counts,
                      SettleReport& report, StageClock& clock, Context& context) {
    bind_surface(domain, attempt.fitted);
    OptimizeOptions settling = options.optimize;
    settling.time_limit_s = counts.optimize_s_left(options);
    Status done = clock.run("settle", [&] {
        return settle_mesh(attempt.fitted.mesh, attempt.topology, domain.model, attempt.fitted.unfitted,
                           settling, *attempt.stats, report, context,
                           attempt.trial ? &*attempt.trial : nullptr);
    });
    attempt.trial.reset();
    counts.optimize_s += clock.times().back().seconds;
    if (!done) return done;
    clock.run("check", [&] { return grade_cells(attempt, context.parallel()); });
    return Done{};
}

Status rescue_mesh(MeshState& state, const Domain& whole, Domain& domain, const MeshOptions& options,
                   const ComputePlace& place, StageClock& clock, Context& context) {
    if (state.best->failed.empty() || options.repairs == 0) return Done{};
    return Rescue(state, whole, domain, options, place, clock, context).run();
}

} // namespace hexopt
