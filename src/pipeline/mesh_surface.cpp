#include "pipeline/mesh_surface.hpp"

#include "pipeline/checkpoint.hpp"
#include "pipeline/feature_domains.hpp"
#include "pipeline/finish_surface.hpp"
#include "pipeline/mesh_progress.hpp"
#include "pipeline/mesh_state.hpp"
#include "pipeline/refine_to_count.hpp"
#include "pipeline/repair_cells.hpp"
#include "pipeline/rescue_mesh.hpp"
#include "pipeline/trim_rounds.hpp"
#include "stages/optimize/contact_guard.hpp"
#include "stages/optimize/retreat.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

/// Repairs end where the octree would grow beyond so many times its first size.
constexpr std::size_t kMostGrowth = 3;
/// Attempts after the best one that may be no better than it.
constexpr std::ptrdiff_t kMostInVain = 2;
/// Where more than this share of the cells fails, one attempt that leaves more than kWorthwhile of the
/// fewest failed so far is the last: refining does not mend what fails all over.
constexpr double kManyFailed = 3e-3, kWorthwhile = 0.8;
/// Of the optimizer's time limit after which no attempt begins: what is left is for settling.
constexpr double kRepairTimeShare = 0.5;
/// So few cells may fail, besides a share of all, that letting them off the surface is tried before cells are
/// refined; it is good where nothing has to go farther than kNear_rel of the diagonal and no cell ends below
/// a scaled Jacobian of kGoodSj.
constexpr double kFewFailed = 20, kFewFailedShare = 3e-3, kNear_rel = 3e-4, kGoodSj = 0.2;

/// From patches of the domain to the input's names; quads without one take that of the nearest patch.
void name_patches(HexMesh& mesh, const Domain& domain, const Parallel& parallel) {
    const bool by_triangle = !domain.triangle_name.empty();
    parallel.for_each(mesh.boundary.size(), 1024, [&](std::size_t i) {
        BoundaryQuad& quad = mesh.boundary[i];
        if (quad.patch != kNoIndex && !by_triangle) {
            quad.patch = domain.patch_name[quad.patch];
            return;
        }
        Point centre(0);
        for (Index v : quad.vertices) centre += 0.25 * mesh.positions[v];
        const Index triangle = domain.model.project_patch(quad.patch, centre).element;
        quad.patch = by_triangle ? domain.triangle_name[triangle]
                                 : domain.patch_name[domain.model.patch_of_triangle(triangle)];
    });
    std::vector<Index> number(domain.names.size(), kNoIndex);
    for (const BoundaryQuad& quad : mesh.boundary) number[quad.patch] = 0;
    mesh.patch_names.clear();
    for (std::size_t p = 0; p < number.size(); ++p) {
        if (number[p] == kNoIndex) continue;
        number[p] = static_cast<Index>(mesh.patch_names.size());
        mesh.patch_names.push_back(domain.names[p]);
    }
    for (BoundaryQuad& quad : mesh.boundary) quad.patch = number[quad.patch];
}

void add_notes(const MeshOutcome& outcome, const Domain& domain, std::vector<std::string>& notes) {
    if (outcome.open_edges + outcome.nonmanifold_edges > 0)
        notes.push_back(fmt::format("The surface has {} open and {} non-manifold edges.", outcome.open_edges,
                                    outcome.nonmanifold_edges));
    if (const WeldReport& weld = outcome.weld; weld.open_edges_after < weld.open_edges_before)
        notes.push_back(fmt::format("{} of {} open edges were closed.",
                                    weld.open_edges_before - weld.open_edges_after, weld.open_edges_before));
    if (outcome.orientation.flipped_triangles > 0)
        notes.push_back(fmt::format("{} triangles were turned over.", outcome.orientation.flipped_triangles));
    if (outcome.orientation.sheet_triangles > 0)
        notes.push_back(fmt::format("{} triangles with the inside on both sides were left out.",
                                    outcome.orientation.sheet_triangles));
    if (outcome.refine.budget_hit())
        notes.emplace_back("The budget of cells was used up: some criteria of refinement were given up.");
    if (std::string bare = describe_bare_surface(outcome.trim); !bare.empty())
        notes.push_back(std::move(bare));
    if (const auto& released = outcome.fit.released_curves; !released.empty()) {
        const auto points = domain.model.curve_points(released.front().curve);
        const Point p = points[points.size() / 2];
        notes.push_back(fmt::format("{} of {} feature curves are not followed by mesh edges, the first near "
                                    "({:.6g}, {:.6g}, {:.6g}).",
                                    released.size(), outcome.fit.curves, p.x, p.y, p.z));
    }
    const std::size_t on_corners =
        outcome.reached ? outcome.reached->corners_after : outcome.fit.captured_corners;
    if (on_corners < outcome.fit.corners)
        notes.push_back(fmt::format("{} of {} corners have no mesh vertex.", outcome.fit.corners - on_corners,
                                    outcome.fit.corners));
    if (outcome.buffer && !outcome.buffer->skipped.empty()) {
        const auto& skipped = outcome.buffer->skipped;
        const auto whole =
            std::count_if(skipped.begin(), skipped.end(), [](const SkippedSheet& s) { return s.whole; });
        notes.push_back(
            fmt::format("{} buffer layers could not be inserted, and {} places were left without one.", whole,
                        std::ssize(skipped) - whole));
    }
    if (!outcome.contacts.empty()) {
        const BoundaryQuad& quad = outcome.mesh.boundary[outcome.contacts.front()];
        const Point p = outcome.mesh.positions[quad.vertices[0]];
        notes.push_back(
            fmt::format("The boundary touches or crosses itself in {} quads, the first near "
                        "({:.6g}, {:.6g}, {:.6g}): smaller cells there (--size, --gap-cells) may help.",
                        outcome.contacts.size(), p.x, p.y, p.z));
    }
    if (const SettleReport& settle = outcome.settle; settle.backed_off_count > 0) {
        const BackedOffVertex& worst = settle.backed_off.front();
        notes.push_back(fmt::format("{} boundary vertices had to leave the surface or its features for valid "
                                    "cells, at most by {:.3g} "
                                    "near ({:.6g}, {:.6g}, {:.6g}).",
                                    settle.backed_off_count, worst.distance, worst.position.x,
                                    worst.position.y, worst.position.z));
    }
    if (outcome.cad && outcome.cad->held > 0)
        notes.push_back(
            fmt::format("{} of {} boundary vertices were not moved all the way onto the exact CAD geometry, "
                        "for the cells there; they are at most {:.3g} from it.",
                        outcome.cad->held, outcome.cad->vertices, outcome.cad->largest_after));
    if (outcome.stats) notes.insert(notes.end(), outcome.stats->notes.begin(), outcome.stats->notes.end());
}

void note_dropped(const MeshOutcome& outcome, const Domain& whole, std::vector<std::string>& notes) {
    if (outcome.dropped_curves.empty()) return;
    const auto points = whole.model.curve_points(outcome.dropped_curves.front());
    const Point p = points[points.size() / 2];
    notes.push_back(fmt::format(
        "{} of {} feature curves, blunt and where cells failed, were given up as noise, the first near "
        "({:.6g}, {:.6g}, {:.6g}); --noise-angle 0 keeps them.",
        outcome.dropped_curves.size(), outcome.curves, p.x, p.y, p.z));
}

/// Where the state between stages is kept, if anywhere.
struct Saving {
    const Checkpoint* checkpoint;
    const StageClock& clock;
    Context& context;

    void save(const MeshState& state) const {
        if (checkpoint) checkpoint->save(state, clock, context);
    }
};

/// From an octree to its best mesh on the surface, through attempts of which later ones are kept only if
/// fewer cells fail.
class Attempts {
  public:
    Attempts(const MeshOptions& options, const ComputePlace& place, MeshState& state, FeatureDomains& domains,
             const Saving& saving, StageClock& clock, Context& context)
        : options_(options), place_(place), state_(state), domains_(domains), saving_(saving), clock_(clock),
          context_(context) {}

    /// Meshes the octree; while cells fail it is refined round them and meshed anew, options.repairs times,
    /// without the features that look like noise there.
    /// Goes on from where the state is, to state.best. Cancelled with a best one: that has no stats.
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
        return Done{};
    }

  private:
    Status fit(LeakPath* leak) {
        const auto own = domains_.without(state_.dropped, context_);
        if (!own) return own.error();
        auto begun = begin_attempt(state_.refined, domains_.whole(), **own, options_, state_.counts, clock_,
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
        const auto own = domains_.without(current.dropped, context_);
        if (!own) return own.error();
        const bool has_earlier = state_.best && state_.best->dropped == current.dropped;
        if (Status done = optimize_attempt(current, has_earlier ? &*state_.best : nullptr, **own, options_,
                                           place_, state_.counts, clock_, context_);
            !done)
            return done;
        const bool is_cancelled = !current.stats;
        const std::vector<Index> noisy = find_noise(current, **own);
        const std::vector<Index> near =
            find_cells_to_refine(current, failed_elsewhere(current, **own, domains_.whole(), noisy));
        state_.attempts.push_back({current.fitted.mesh.cell_count(), current.failed.size(), 0});
        log(current);
        const bool is_best = !state_.best || current.failed.size() < state_.best->failed.size();
        if (is_best) state_.best = std::move(current);
        state_.current.reset();
        if (is_cancelled) {
            state_.best->stats.reset();
            return Done{};
        }
        state_.phase = MeshPhase::refined;
        const bool goes_on = !state_.best->failed.empty() && !(near.empty() && noisy.empty()) &&
                             state_.round < options_.repairs && !is_in_vain() &&
                             !(is_best && settles_near(*state_.best, **own)) && prepare_next(near, noisy);
        if (!goes_on) end();
        return Done{};
    }

    /// Whether the last attempts were no better than one before them.
    bool is_in_vain() const {
        const auto best = std::min_element(
            state_.attempts.begin(), state_.attempts.end(),
            [](const AttemptCount& a, const AttemptCount& b) { return a.failed < b.failed; });
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

    /// Whether cells fail that are few and only need the surface to be left by next to nothing.
    bool settles_near(MeshAttempt& attempt, const Domain& domain) {
        const std::size_t failed = attempt.failed.size(), cells = attempt.fitted.mesh.cell_count();
        const double near = std::min(kNear_rel, options_.optimize.max_deviation_rel);
        if (static_cast<double>(failed) > kFewFailed + kFewFailedShare * static_cast<double>(cells) ||
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
                   return raised && raised->min_sj_after >= kGoodSj;
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
        const RefineCount count = refine_cells(state_.refined, near, context_);
        state_.attempts.back().refined = count.requested;
        ++state_.round;
        state_.dropped.insert(state_.dropped.end(), noisy.begin(), noisy.end());
        std::sort(state_.dropped.begin(), state_.dropped.end());
        return count.requested > 0 || !noisy.empty();
    }

    void end() {
        state_.current.reset();
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
    std::vector<Index> find_cells_to_refine(const MeshAttempt& attempt,
                                            const std::vector<Index>& failed) const {
        const HexMesh& octree = state_.refined.octree;
        for (int rings = 1; rings >= 0; --rings) {
            std::vector<Index> near = find_cells_round(octree, attempt.fitted.mesh, failed, rings);
            if (octree.cell_count() + 7 * near.size() <= kMostGrowth * state_.first_cells) return near;
        }
        return {};
    }

    void log(const MeshAttempt& attempt) const {
        if (attempt.failed.empty()) return;
        const Point p = attempt.fitted.mesh.positions[attempt.fitted.mesh.cells[attempt.failed.front()][0]];
        context_.log(LogLevel::debug,
                     fmt::format("attempt {}: {} of {} cells fail, the first near ({:.6g}, {:.6g}, {:.6g})",
                                 state_.round + 1, attempt.failed.size(), attempt.fitted.mesh.cell_count(),
                                 p.x, p.y, p.z));
    }

    const MeshOptions& options_;
    const ComputePlace& place_;
    MeshState& state_;
    FeatureDomains& domains_;
    const Saving& saving_;
    StageClock& clock_;
    Context& context_;
};

/// Lets what fails leave the surface and raises the worst cells of the best attempt; meshes anew where that
/// was not enough.
Status settle(MeshState& state, const Domain& whole, Domain& domain, const MeshOptions& options,
              const ComputePlace& place, const Saving& saving, StageClock& clock, Context& context) {
    MeshAttempt& best = *state.best;
    bind_surface(domain, best.fitted); // the last attempt need not be the best
    if (!best.stats || state.phase == MeshPhase::settled) return Done{};
    begin_stage(context, "settle", progress::kOptimizeEnd, progress::kSettleEnd);
    Status done = settle_attempt(best, domain, options, state.counts, state.settle, clock, context);
    if (done) done = rescue_mesh(state, whole, domain, options, place, clock, context);
    if (!done && done.error().code != ErrorCode::cancelled) return done;
    state.phase = MeshPhase::settled;
    if (!done) state.best->stats.reset();
    if (state.best->stats) saving.save(state);
    return Done{};
}

/// Brings the settled mesh closer to features and creases.
Status finish(MeshState& state, Domain& domain, const MeshOptions& options, MeshOutcome& outcome,
              StageClock& clock, Context& context) {
    MeshAttempt& best = *state.best;
    if (!best.stats) return Done{};
    const auto reached =
        finish_surface(best, domain, options, state.counts.optimize_s_left(options), clock, context);
    find_backed_off(best.fitted.mesh, domain.model, state.settle);
    if (reached)
        outcome.reached = *reached;
    else if (reached.error().code == ErrorCode::cancelled)
        best.stats.reset();
    else
        return reached.error();
    return Done{};
}

/// Moves what the stages came to to the outcome.
void take_results(MeshState state, MeshOutcome& outcome, Topology& topology) {
    MeshAttempt& best = *state.best;
    outcome.refine = state.refined.stats;
    outcome.trim_rounds = state.counts.trims.count;
    outcome.fit_rounds = state.counts.fit_rounds;
    outcome.attempts = std::move(state.attempts);
    outcome.trim = best.trim;
    outcome.fit = std::move(best.fit);
    outcome.buffer = std::move(best.buffer);
    outcome.start = std::move(best.start);
    outcome.stats = std::move(best.stats);
    outcome.mesh = std::move(best.fitted.mesh);
    outcome.settle = std::move(state.settle);
    topology = std::move(best.topology);
}

Status measure(const Domain& domain, const Topology& topology, const MeshOptions& options,
               MeshOutcome& outcome, StageClock& clock, Context& context) {
    begin_stage(context, "measure", progress::kSettleEnd, progress::kMeasureEnd);
    HexMesh& mesh = outcome.mesh;
    Context unhurried(context.parallel().threads(), context.seed()); // measures even after a cancel
    std::swap(mesh.positions, outcome.start);
    auto before = clock.run("quality_before", [&] { return compute_quality(mesh, topology, {}, unhurried); });
    std::swap(mesh.positions, outcome.start);
    if (!before) return before.error();
    outcome.before = std::move(*before);
    auto after = clock.run("quality_after", [&] { return compute_quality(mesh, topology, {}, unhurried); });
    if (!after) return after.error();
    outcome.after = std::move(*after);
    auto deviation = clock.run(
        "deviation", [&] { return measure_deviation(mesh, topology, domain.model, {}, unhurried); });
    if (!deviation) return deviation.error();
    outcome.deviation = *deviation;
    outcome.contacts =
        clock.run("contacts", [&] { return find_boundary_contacts(mesh, topology, unhurried.parallel()); });
    const ValidityCounts& validity = outcome.after.validity;
    const bool is_below = options.target_min_sj && validity.min_scaled_jacobian < *options.target_min_sj;
    outcome.verdict = !outcome.stats                                      ? ErrorCode::cancelled
                      : !validity.is_valid() || !outcome.contacts.empty() ? ErrorCode::no_valid_mesh
                      : is_below                                          ? ErrorCode::below_target
                                                                          : ErrorCode::ok;
    return Done{};
}

/// Moves the boundary onto the exact geometry; a file that is no longer what was meshed is no reason to lose
/// the mesh.
Status use_cad(const PreparedDomain& prepared, const Domain& domain, const MeshOptions& options,
               MeshOutcome& outcome, StageClock& clock, Context& context) {
    if (prepared.cad.empty() || !outcome.stats) return Done{};
    auto moved = clock.run("cad_projection", [&] {
        return move_onto_cad(outcome.mesh, domain.model, prepared.cad, options.optimize.min_sj, context);
    });
    if (moved)
        outcome.cad = *moved;
    else if (moved.error().code == ErrorCode::cancelled)
        outcome.stats.reset();
    else
        outcome.notes.push_back(
            "The boundary was not moved onto the CAD geometry: " + moved.error().one_line() + ".");
    return Done{};
}

Status check_options(const MeshOptions& options) {
    if (options.fit_repairs < 0 || options.fit_repairs > 5)
        return make_error(ErrorCode::usage, "fit", "", "the repairs must lie in 0..5");
    if (options.repairs < 0 || options.repairs > 10)
        return make_error(ErrorCode::usage, "optimize", "", "the repairs must lie in 0..10");
    return Done{};
}

/// From the checkpoint where that holds a state, else from refining.
Result<MeshState> start_or_resume(const Domain& domain, const MeshOptions& options, MeshOutcome& outcome,
                                  StageClock& clock, Context& context, LeakPath* leak,
                                  Checkpoint* checkpoint) {
    if (checkpoint && checkpoint->has_state()) {
        auto state = checkpoint->load(domain, clock, context);
        if (state) outcome.resumed = name_of(state->phase);
        return state;
    }
    context.set_progress_range(progress::kSurfaceEnd, progress::kRefineEnd);
    auto counted = refine_to_count(domain, options, clock, context, leak);
    if (!counted) return counted.error();
    MeshState state(std::move(counted->refined));
    state.counts.trims = std::move(counted->rounds);
    state.counts.trimmed = std::move(counted->trimmed);
    state.counts.fitted = std::move(counted->fitted);
    Saving{checkpoint, clock, context}.save(state);
    return state;
}

void describe_domain(const PreparedDomain& prepared, MeshOutcome& outcome) {
    outcome.weld = prepared.weld;
    outcome.orientation = prepared.orientation;
    const Domain& domain = prepared.domain;
    outcome.patches = domain.model.patch_count();
    outcome.curves = domain.model.curve_count();
    outcome.corners = domain.model.corner_count();
    outcome.dropped_triangles = domain.dropped_triangles;
    outcome.open_edges = domain.open_edges;
    outcome.nonmanifold_edges = domain.nonmanifold_edges;
}

} // namespace

Result<MeshOutcome> mesh_surface(const TriangleSoup& surface, const MeshOptions& options, StageClock& clock,
                                 Context& context, LeakPath* leak) {
    begin_stage(context, "surface", 0, progress::kSurfaceEnd);
    auto prepared = prepare_domain(surface, options, clock, context);
    if (!prepared) return prepared.error();
    return mesh_domain(std::move(*prepared), options, clock, context, leak);
}

Result<MeshOutcome> mesh_domain(PreparedDomain prepared, const MeshOptions& options, StageClock& clock,
                                Context& context, LeakPath* leak, Checkpoint* checkpoint) {
    if (Status ok = check_options(options); !ok) return ok.error();
    MeshOutcome outcome;
    FeatureDomains domains(prepared.domain);
    describe_domain(prepared, outcome);
    const auto place = open_place(options.compute, context.parallel());
    if (!place) return place.error();
    outcome.device = place->reason;
    auto state = start_or_resume(domains.whole(), options, outcome, clock, context, leak, checkpoint);
    if (!state) return state.error();
    const Saving saving{checkpoint, clock, context};
    if (Status done = Attempts(options, *place, *state, domains, saving, clock, context).run(leak); !done)
        return done.error();
    const auto own = domains.without(state->best->dropped, context);
    if (!own) return own.error();
    Domain& domain = **own;
    outcome.dropped_curves = state->best->dropped;
    if (Status done = settle(*state, domains.whole(), domain, options, *place, saving, clock, context); !done)
        return done.error();
    if (Status done = finish(*state, domain, options, outcome, clock, context); !done) return done.error();
    Topology topology;
    take_results(std::move(*state), outcome, topology);
    if (Status done = use_cad(prepared, domain, options, outcome, clock, context); !done) return done.error();
    if (Status done = measure(domain, topology, options, outcome, clock, context); !done) return done.error();
    name_patches(outcome.mesh, domain, context.parallel());
    if (options.buffers && !outcome.buffer)
        outcome.notes.emplace_back("Buffer layers were left out: with them not all cells became valid.");
    note_dropped(outcome, domains.whole(), outcome.notes);
    add_notes(outcome, domain, outcome.notes);
    return outcome;
}

} // namespace hexopt
