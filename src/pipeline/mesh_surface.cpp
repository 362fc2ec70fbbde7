#include "pipeline/mesh_surface.hpp"

#include "pipeline/check_initial_mesh.hpp"
#include "pipeline/checkpoint.hpp"
#include "pipeline/finish_surface.hpp"
#include "pipeline/follow_borders.hpp"
#include "pipeline/make_attempts.hpp"
#include "pipeline/mesh_progress.hpp"
#include "pipeline/mesh_state.hpp"
#include "pipeline/refine_to_count.hpp"
#include "pipeline/rescue_mesh.hpp"
#include "pipeline/trim_rounds.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <iterator>

namespace hexopt {

namespace {

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

/// Distances of the surface from the mesh above this fraction of its diagonal are told.
constexpr double kFar_rel = 1e-3;

/// A part of the surface on which no quad lies: boundary vertices may all be on the surface nevertheless.
std::string describe_far_surface(const Deviation& deviation) {
    const DirectedDeviation& far = deviation.surface_to_mesh;
    if (!(far.largest > kFar_rel * deviation.diagonal)) return {};
    return fmt::format(
        "The surface is up to {:.3g} ({:.2g} of the diagonal) away from the mesh, farthest near "
        "({:.6g}, {:.6g}, {:.6g}): smaller cells there (--region, --cells) may help.",
        far.largest, far.largest / deviation.diagonal, far.at.x, far.at.y, far.at.z);
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
    if (outcome.left_out_bodies > 0)
        notes.push_back(
            fmt::format("{} closed surfaces were left out, which do not bound what the seeds are in.",
                        outcome.left_out_bodies));
    if (outcome.orientation.sheet_triangles > 0)
        notes.push_back(fmt::format("{} triangles with the inside on both sides were left out.",
                                    outcome.orientation.sheet_triangles));
    if (std::string budget = outcome.refine.describe_budget(); !budget.empty())
        notes.push_back(std::move(budget));
    if (std::string bare = describe_bare_surface(outcome.trim); !bare.empty())
        notes.push_back(std::move(bare));
    if (std::string far = describe_far_surface(outcome.deviation); !far.empty())
        notes.push_back(std::move(far));
    if (const auto& released = outcome.fit.released_curves; !released.empty()) {
        const auto points = domain.model.curve_points(released.front().curve);
        const Point p = points[points.size() / 2];
        notes.push_back(
            fmt::format("{} of {} feature curves are not followed by mesh edges all along ({:.1f} % of "
                        "the length of all is), the first near ({:.6g}, {:.6g}, {:.6g}).",
                        released.size(), outcome.fit.curves,
                        100 * outcome.fit.followed_length / outcome.fit.curve_length, p.x, p.y, p.z));
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
    if (outcome.warped && outcome.warped->warped_after > 0) notes.push_back(describe_warped(*outcome.warped));
    if (outcome.stats) notes.insert(notes.end(), outcome.stats->notes.begin(), outcome.stats->notes.end());
}

void note_narrow(const MeshOutcome& outcome, const Domain& whole, std::vector<std::string>& notes) {
    if (outcome.narrow_curves.empty()) return;
    const auto points = whole.model.curve_points(outcome.narrow_curves.front());
    const Point p = points[points.size() / 2];
    notes.push_back(
        fmt::format("{} feature curves or parts of them, which bound cusps or ledges too narrow for "
                    "cells, were given up, the first near ({:.6g}, {:.6g}, {:.6g}); smaller "
                    "cells there or --narrow-features 0 keep them.",
                    outcome.narrow_curves.size(), p.x, p.y, p.z));
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
Status finish(MeshState& state, const Domain& whole, Domain& domain, const MeshOptions& options,
              MeshOutcome& outcome, StageClock& clock, Context& context) {
    MeshAttempt& best = *state.best;
    if (!best.stats) return Done{};
    const auto reached =
        finish_surface(best, whole, domain, options, state.counts.optimize_s_left(options), clock, context);
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
    outcome.refine = state.octree.stats();
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
Status use_cad(const PreparedDomain& prepared, const Domain& domain, const Topology& topology,
               const MeshOptions& options, MeshOutcome& outcome, StageClock& clock, Context& context) {
    if (prepared.cad.empty() || !outcome.stats) return Done{};
    auto moved = clock.run("cad_projection", [&] {
        return move_onto_cad(outcome.mesh, topology, domain.model, prepared.cad, options.optimize.min_sj,
                             context);
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

/// Flattens faces that finite-volume solvers cannot cut into tetrahedra.
Status flatten(const BoundaryModel& model, const Topology& topology, const MeshOptions& options,
               MeshOutcome& outcome, StageClock& clock, Context& context) {
    if (!outcome.stats) return Done{};
    FlattenOptions how;
    how.min_sj = std::min(how.min_sj, options.optimize.min_sj);
    how.last_min_sj = std::min(how.last_min_sj, options.optimize.min_sj);
    how.model = &model;
    how.slack_rel = 0.25 * options.refine.chord_error_rel;
    auto flattened =
        clock.run("flatten", [&] { return flatten_faces(outcome.mesh, topology, how, context); });
    if (flattened)
        outcome.warped = *flattened;
    else if (flattened.error().code == ErrorCode::cancelled)
        outcome.stats.reset();
    else
        return flattened.error();
    return Done{};
}

Status check_options(const MeshOptions& options) {
    if (options.fit_repairs < 0 || options.fit_repairs > 5)
        return make_error(ErrorCode::usage, "fit", "", "the repairs must lie in 0..5");
    if (options.repairs < 0 || options.repairs > 10)
        return make_error(ErrorCode::usage, "optimize", "", "the repairs must lie in 0..10");
    return Done{};
}

/// Gives up features, or parts of them, beside which no cells fit.
Status give_up_narrow(MeshState& state, NarrowCurves narrow, FeatureDomains& domains, Context& context) {
    if (narrow.narrow.empty()) return Done{};
    if (Status done = domains.split(narrow.cuts, context); !done) return done;
    if (!narrow.cuts.empty()) state.counts.trims.memory = {}; // which numbers triangles
    state.cuts = std::move(narrow.cuts);
    state.dropped = state.narrow = std::move(narrow.narrow);
    return Done{};
}

/// From the checkpoint where that holds a state, else from refining.
Result<MeshState> start_or_resume(FeatureDomains& domains, const MeshOptions& options, MeshOutcome& outcome,
                                  StageClock& clock, Context& context, LeakPath* leak,
                                  Checkpoint* checkpoint) {
    if (checkpoint && checkpoint->has_state()) {
        auto state = checkpoint->load(domains.whole(), clock, context);
        if (!state) return state;
        outcome.resumed = name_of(state->phase);
        if (Status done = domains.split(state->cuts, context); !done) return done.error();
        return state;
    }
    context.set_progress_range(progress::kSurfaceEnd, progress::kRefineEnd);
    auto counted = refine_to_count(domains.whole(), options, clock, context, leak);
    if (!counted) return counted.error();
    MeshState state(std::move(counted->refined));
    state.counts.trims = std::move(counted->rounds);
    state.counts.trimmed = std::move(counted->trimmed);
    state.counts.fitted = std::move(counted->fitted);
    if (Status done = give_up_narrow(state, std::move(counted->narrow), domains, context); !done)
        return done.error();
    Saving{checkpoint, clock, context}.save(state);
    return state;
}

void describe_domain(const PreparedDomain& prepared, MeshOutcome& outcome) {
    outcome.weld = prepared.weld;
    outcome.orientation = prepared.orientation;
    outcome.left_out_bodies = prepared.left_out_bodies;
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
    if (Status ok = check_initial_mesh(prepared.domain, options, context); !ok) return ok.error();
    MeshOutcome outcome;
    const auto borders = follow_borders(prepared, options, clock, context);
    if (!borders) return borders.error();
    outcome.followed_borders = *borders;
    FeatureDomains domains(prepared.domain);
    describe_domain(prepared, outcome);
    const auto place = open_place(options.compute, context.parallel());
    if (!place) return place.error();
    outcome.device = place->reason;
    auto state = start_or_resume(domains, options, outcome, clock, context, leak, checkpoint);
    if (!state) return state.error();
    const Saving saving{checkpoint, clock, context};
    if (Status done = make_attempts(*state, domains, options, *place, saving, clock, context, leak); !done)
        return done.error();
    const auto own = domains.without(state->best->dropped, context);
    if (!own) return own.error();
    Domain& domain = **own;
    outcome.narrow_curves = state->narrow;
    std::set_difference(state->best->dropped.begin(), state->best->dropped.end(), state->narrow.begin(),
                        state->narrow.end(), std::back_inserter(outcome.dropped_curves));
    if (Status done = settle(*state, domains.whole(), domain, options, *place, saving, clock, context); !done)
        return done.error();
    if (Status done = finish(*state, domains.whole(), domain, options, outcome, clock, context); !done)
        return done.error();
    Topology topology;
    take_results(std::move(*state), outcome, topology);
    if (Status done = use_cad(prepared, domain, topology, options, outcome, clock, context); !done)
        return done.error();
    if (Status done = flatten(domain.model, topology, options, outcome, clock, context); !done)
        return done.error();
    if (Status done = measure(domain, topology, options, outcome, clock, context); !done) return done.error();
    name_patches(outcome.mesh, domain, context.parallel());
    if (options.buffers && !outcome.buffer)
        outcome.notes.emplace_back("Buffer layers were left out: with them not all cells became valid.");
    if (outcome.mesh.cell_count() > options.refine.max_cells)
        outcome.notes.push_back(
            fmt::format("The mesh has more cells than --max-cells {}, which bounds the octree: "
                        "its layers under the surface come on top, and the initial mesh is "
                        "where it begins.",
                        options.refine.max_cells));
    note_narrow(outcome, domains.whole(), outcome.notes);
    note_dropped(outcome, domains.whole(), outcome.notes);
    add_notes(outcome, domain, outcome.notes);
    return outcome;
}

} // namespace hexopt
