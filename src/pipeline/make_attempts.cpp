#include "pipeline/make_attempts.hpp"

#include "pipeline/repair_cells.hpp"
#include "stages/optimize/retreat.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

namespace hexopt {

namespace {

/// Attempts after the best one that may be no better than it.
constexpr std::ptrdiff_t kMostInVain = 2;
/// Where more than this share of the cells fails, one attempt that leaves more than kWorthwhile of the
/// fewest failed so far is the last: refining does not mend what fails all over.
constexpr double kManyFailed = 3e-3, kWorthwhile = 0.8;
/// Of the optimizer's time limit after which no attempt begins: what is left is for settling.
constexpr double kRepairTimeShare = 0.5;
/// So few cells may fail or be low, besides a share of all, that letting them off the surface is tried before
/// cells are refined; it is good where nothing has to go farther than kNear_rel of the diagonal and no cell
/// ends below a scaled Jacobian of kLowScaledJacobian. (Of 242 runs on real models with trials, those that
/// ended with a good one had at most 5 cells failing and 98 of 53,000 low.)
constexpr double kFewFailed = 10, kFewFailedShare = 1e-4, kFewLow = 20, kFewLowShare = 2e-3, kNear_rel = 3e-4;

class Attempts {
  public:
    Attempts(const MeshOptions& options, const ComputePlace& place, MeshState& state, FeatureDomains& domains,
             const Saving& saving, StageClock& clock, Context& context)
        : options_(options), place_(place), state_(state), domains_(domains), saving_(saving), clock_(clock),
          context_(context) {}

    Status run(LeakPath* leak) {
        while (state_.phase < MeshPhase::attempted) {
            Status done = state_.phase == MeshPhase::refined ? fit(leak) : optimize();
            if (!done && !state_.best) return done;
            if (!done && done.error().code == ErrorCode::cancelled) {
                state_.best->stats.reset();
                break;
            }
            if (!done) {
                context_.log(LogLevel::warning, "the last repair is left out: " + done.error().one_line());
                end();
            }
            if (state_.best && !state_.best->stats) break;
            saving_.save(state_);
        }
        if (HexMesh& mesh = state_.best->fitted.mesh; state_.best->topology.vertex_cell.item.empty())
            state_.best->topology = compute_topology(mesh, context_.parallel());
        return Done{};
    }

  private:
    Status fit(LeakPath* leak) {
        const auto own = domains_.without(state_.dropped, context_);
        if (!own) return own.error();
        auto begun = begin_attempt(state_.octree, domains_.whole(), **own, options_, state_.counts, clock_,
                                   context_, leak);
        if (!begun) return begun.error();
        begun->dropped = state_.dropped;
        state_.current = std::move(*begun);
        state_.phase = MeshPhase::fitted;
        return Done{};
    }

    /// Ends the attempt under way and prepares the next one.
    Status optimize() {
        MeshAttempt& current = *state_.current;
        std::optional<EarlierAttempt> earlier;
        if (state_.best) {
            auto entities = domains_.map(state_.best->dropped, current.dropped, context_);
            if (!entities) return entities.error();
            earlier.emplace(*state_.best, std::move(*entities));
        }
        const auto own = domains_.without(current.dropped, context_);
        if (!own) return own.error();
        if (Status done =
                optimize_attempt(current, earlier, **own, options_, place_, state_.counts, clock_, context_);
            !done)
            return done;
        const bool is_cancelled = !current.stats;
        const std::vector<Index> noisy = find_noise(current, **own);
        // Finer cells have not raised low ones where they were tried.
        const std::vector<Index> near = find_cells_to_refine(
            current, cells_elsewhere(current.failed, current, **own, domains_.whole(), noisy));
        state_.attempts.push_back(
            {current.fitted.mesh.cell_count(), current.failed.size(), current.low.size(), 0});
        log(current);
        const bool is_best = !state_.best || is_better(current, *state_.best);
        if (is_best) state_.best = std::move(current);
        state_.current.reset();
        if (is_cancelled) {
            state_.best->stats.reset();
            return Done{};
        }
        state_.phase = MeshPhase::refined;
        const bool goes_on = !(state_.best->failed.empty() && (!is_best || state_.best->low.empty())) &&
                             !(near.empty() && noisy.empty()) && state_.round < options_.repairs &&
                             !is_in_vain() && !(is_best && settles_near(*state_.best, **own)) &&
                             prepare_next(near, noisy);
        if (goes_on)
            state_.best->topology = {}; // only needed in the end
        else
            end();
        return Done{};
    }

    static bool is_better(const MeshAttempt& a, const MeshAttempt& b) {
        return std::pair(a.failed.size(), a.low.size()) < std::pair(b.failed.size(), b.low.size());
    }

    /// Whether the last attempts were no better than one before them.
    bool is_in_vain() const {
        const auto best = std::min_element(state_.attempts.begin(), state_.attempts.end(),
                                           [](const AttemptCount& a, const AttemptCount& b) {
                                               return std::pair(a.failed, a.low) < std::pair(b.failed, b.low);
                                           });
        return state_.attempts.end() - best > kMostInVain || is_hopeless();
    }

    bool is_hopeless() const {
        const auto& attempts = state_.attempts;
        const AttemptCount& last = attempts.back();
        if (!(static_cast<double>(last.failed) > kManyFailed * static_cast<double>(last.cells))) return false;
        return std::any_of(attempts.begin(), attempts.end() - 1, [&](const AttemptCount& a) {
            return static_cast<double>(last.failed) > kWorthwhile * static_cast<double>(a.failed);
        });
    }

    /// Whether cells fail or are low that are few and only need the surface to be left by next to nothing.
    bool settles_near(MeshAttempt& attempt, const Domain& domain) {
        const auto failed = static_cast<double>(attempt.failed.size()),
                   low = static_cast<double>(attempt.low.size()),
                   cells = static_cast<double>(attempt.fitted.mesh.cell_count());
        const double near = std::min(kNear_rel, options_.optimize.max_deviation_rel);
        if (failed > kFewFailed + kFewFailedShare * cells || low > kFewLow + kFewLowShare * cells ||
            !(near > 0))
            return false;
        HexMesh trial = attempt.fitted.mesh;
        RetreatOptions back;
        back.unfitted = attempt.fitted.unfitted;
        back.max_deviation = options_.optimize.max_deviation_rel * domain.model.diagonal();
        return try_to_settle([&](double time_limit_s) {
                   back.time_limit_s = time_limit_s;
                   const RetreatReport report =
                       retreat(trial, attempt.topology, domain.model, back, context_);
                   if (context_.is_cancelled()) return false;
                   attempt.trial = SettleTrial{trial.positions, report, {}};
                   SettleReport off;
                   find_backed_off(trial, domain.model, off);
                   return report.bad_after + report.touching_after == 0 && off.deviation_rel <= near;
               }) &&
               try_to_settle([&](double time_limit_s) {
                   OptimizeOptions raising = options_.optimize;
                   raising.time_limit_s = time_limit_s;
                   const auto raised =
                       raise_settled(trial, attempt.topology, domain.model, raising, context_);
                   if (raised && raising.max_min) {
                       attempt.trial->positions = std::move(trial.positions);
                       attempt.trial->raised = *raised;
                   }
                   return raised && raised->min_sj_after >= kLowScaledJacobian;
               });
    }

    /// Runs a step that the optimizer's time limit bounds, if any of that is left.
    template <class Step>
    bool try_to_settle(const Step& step) {
        const double left_s = state_.counts.optimize_s_left(options_);
        if (!(left_s > 0)) return false;
        const bool good = clock_.run("try_settle", [&] { return step(left_s); });
        state_.counts.optimize_s += clock_.times().back().seconds;
        return good;
    }

    /// False: there is no next attempt.
    bool prepare_next(const std::vector<Index>& near, const std::vector<Index>& noisy) {
        if (!(state_.counts.optimize_s < kRepairTimeShare * options_.optimize.time_limit_s)) return false;
        const RefineCount count = refine_cells(state_.octree.open(context_), near, context_);
        state_.attempts.back().refined = count.requested;
        ++state_.round;
        state_.dropped.insert(state_.dropped.end(), noisy.begin(), noisy.end());
        std::sort(state_.dropped.begin(), state_.dropped.end());
        return count.requested > 0 || !noisy.empty();
    }

    void end() {
        state_.current.reset();
        state_.octree.put_away();
        state_.phase = MeshPhase::attempted;
    }

    std::vector<Index> find_noise(const MeshAttempt& attempt, const Domain& own) {
        if (!(options_.noise_angle_deg > 0) || !options_.feature_lines.empty()) return {};
        std::vector<Index> noisy =
            find_noisy_curves(attempt, own, domains_.whole(), options_.noise_angle_deg);
        if (!noisy.empty())
            context_.log(LogLevel::debug,
                         fmt::format("{} of {} features are noise", noisy.size(), own.model.curve_count()));
        return noisy;
    }

    /// Cells that hold what failed, and a ring round them where so many fit; none: too many.
    std::vector<Index> find_cells_to_refine(const MeshAttempt& attempt, const std::vector<Index>& failed) {
        if (failed.empty()) return {};
        const HexMesh& octree = state_.octree.open(context_).octree;
        for (int rings = 1; rings >= 0; --rings) {
            std::vector<Index> near = find_cells_round(octree, attempt.fitted.mesh, failed, rings);
            if (state_.may_refine(near.size())) return near;
        }
        return {};
    }

    void log(const MeshAttempt& attempt) const {
        const auto& bad = attempt.failed.empty() ? attempt.low : attempt.failed;
        if (bad.empty()) return;
        const Point p = attempt.fitted.mesh.positions[attempt.fitted.mesh.cells[bad.front()][0]];
        context_.log(LogLevel::debug,
                     fmt::format("attempt {}: {} of {} cells fail, {} are low, the first near ({:.6g}, "
                                 "{:.6g}, {:.6g})",
                                 state_.round + 1, attempt.failed.size(), attempt.fitted.mesh.cell_count(),
                                 attempt.low.size(), p.x, p.y, p.z));
    }

    const MeshOptions& options_;
    const ComputePlace& place_;
    MeshState& state_;
    FeatureDomains& domains_;
    const Saving& saving_;
    StageClock& clock_;
    Context& context_;
};

} // namespace

Status make_attempts(MeshState& state, FeatureDomains& domains, const MeshOptions& options,
                     const ComputePlace& place, const Saving& saving, StageClock& clock, Context& context,
                     LeakPath* leak) {
    return Attempts(options, place, state, domains, saving, clock, context).run(leak);
}

} // namespace hexopt
