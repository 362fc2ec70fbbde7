#include "pipeline/mesh_surface.hpp"

#include "pipeline/mesh_attempt.hpp"
#include "pipeline/mesh_progress.hpp"
#include "pipeline/refine_to_count.hpp"
#include "pipeline/repair_cells.hpp"
#include "pipeline/trim_rounds.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

/// Repairs end where the octree would grow beyond so many times its first size.
constexpr std::size_t kMostGrowth = 3;

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
                                    released.size(), outcome.curves, p.x, p.y, p.z));
    }
    if (outcome.fit.captured_corners < outcome.fit.corners)
        notes.push_back(fmt::format("{} of {} corners have no mesh vertex.",
                                    outcome.fit.corners - outcome.fit.captured_corners, outcome.fit.corners));
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

/// What the attempts came to, where later ones are kept only if fewer cells fail.
class Attempts {
  public:
    Attempts(const MeshOptions& options, MeshOutcome& outcome, AttemptCounts& counts)
        : options_(options), outcome_(outcome), counts_(counts) {}

    /// Meshes the octree; while cells fail it is refined round them and meshed anew, options.repairs times.
    Result<MeshAttempt> run(RefineOutput& refined, Domain& domain, StageClock& clock, Context& context,
                            LeakPath* leak) {
        const std::size_t most_cells = kMostGrowth * refined.octree.cell_count();
        std::optional<MeshAttempt> best;
        for (int round = 0;; ++round) {
            auto next = attempt_mesh(refined, domain, options_, counts_, clock, context, leak);
            if (!next && !best) return next;
            if (!next) {
                if (next.error().code == ErrorCode::cancelled)
                    best->stats.reset();
                else
                    context.log(LogLevel::warning, "the last repair is left out: " + next.error().one_line());
                break;
            }
            const std::vector<Index> near = find_cells_to_refine(refined.octree, *next, most_cells);
            const bool cancelled = !next->stats;
            outcome_.attempts.push_back({next->fitted.mesh.cell_count(), next->failed.size(), 0});
            log(round, *next, context);
            if (!best || next->failed.size() < best->failed.size()) best = std::move(*next);
            if (cancelled) best->stats.reset();
            if (cancelled || best->failed.empty() || near.empty() || round == options_.repairs) break;
            if (!(counts_.optimize_s_left(options_) > 0)) break;
            const RefineCount count = refine_cells(refined, near, context);
            outcome_.attempts.back().refined = count.requested;
            if (count.requested == 0) break;
        }
        outcome_.refine = refined.stats;
        outcome_.trim_rounds = counts_.trims.count;
        outcome_.fit_rounds = counts_.fit_rounds;
        return std::move(*best);
    }

  private:
    /// Cells that hold what failed, and a ring round them where so many fit; none: too many.
    static std::vector<Index> find_cells_to_refine(const HexMesh& octree, const MeshAttempt& attempt,
                                                   std::size_t most_cells) {
        for (int rings = 1; rings >= 0; --rings) {
            std::vector<Index> near = find_cells_round(octree, attempt.fitted.mesh, attempt.failed, rings);
            if (octree.cell_count() + 7 * near.size() <= most_cells) return near;
        }
        return {};
    }

    void log(int round, const MeshAttempt& attempt, Context& context) const {
        if (attempt.failed.empty()) return;
        const Point p = attempt.fitted.mesh.positions[attempt.fitted.mesh.cells[attempt.failed.front()][0]];
        context.log(LogLevel::debug,
                    fmt::format("attempt {}: {} of {} cells fail, the first near ({:.6g}, {:.6g}, {:.6g})",
                                round + 1, attempt.failed.size(), attempt.fitted.mesh.cell_count(), p.x, p.y,
                                p.z));
    }

    const MeshOptions& options_;
    MeshOutcome& outcome_;
    AttemptCounts& counts_;
};

/// Lets what fails leave the surface, raises the worst cells and moves the attempt to the outcome.
Status settle(MeshAttempt& attempt, Domain& domain, const OptimizeOptions& options, MeshOutcome& outcome,
              StageClock& clock, Context& context) {
    outcome.trim = attempt.trim;
    outcome.fit = std::move(attempt.fit);
    outcome.buffer = std::move(attempt.buffer);
    outcome.start = std::move(attempt.start);
    outcome.stats = std::move(attempt.stats);
    outcome.mesh = std::move(attempt.fitted.mesh);
    if (outcome.attempts.size() > 1)
        bind_surface(domain, attempt.fitted); // the last attempt need not be the best
    if (!outcome.stats) return Done{};
    begin_stage(context, "settle", progress::kOptimizeEnd, progress::kSettleEnd);
    Status done = clock.run("settle", [&] {
        return settle_mesh(outcome.mesh, attempt.topology, domain.model, attempt.fitted.unfitted, options,
                           *outcome.stats, outcome.settle, context);
    });
    if (!done && done.error().code != ErrorCode::cancelled) return done;
    if (!done) outcome.stats.reset();
    return Done{};
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
Status use_cad(const PreparedDomain& prepared, const MeshOptions& options, MeshOutcome& outcome,
               StageClock& clock, Context& context) {
    if (prepared.cad.empty() || !outcome.stats) return Done{};
    auto moved = clock.run("cad_projection", [&] {
        return move_onto_cad(outcome.mesh, prepared.domain.model, prepared.cad, options.optimize.min_sj,
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

Status check_options(const MeshOptions& options) {
    if (options.fit_repairs < 0 || options.fit_repairs > 5)
        return make_error(ErrorCode::usage, "fit", "", "the repairs must lie in 0..5");
    if (options.repairs < 0 || options.repairs > 10)
        return make_error(ErrorCode::usage, "optimize", "", "the repairs must lie in 0..10");
    return Done{};
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
                                Context& context, LeakPath* leak) {
    if (Status ok = check_options(options); !ok) return ok.error();
    MeshOutcome outcome;
    Domain& domain = prepared.domain;
    describe_domain(prepared, outcome);
    context.set_progress_range(progress::kSurfaceEnd, progress::kRefineEnd);
    auto refined = clock.run("refine", [&] { return refine_to_count(domain, options, context, leak); });
    if (!refined) return refined.error();
    AttemptCounts counts;
    auto attempt = Attempts(options, outcome, counts).run(*refined, domain, clock, context, leak);
    if (!attempt) return attempt.error();
    OptimizeOptions settling = options.optimize;
    settling.time_limit_s = counts.optimize_s_left(options);
    if (Status done = settle(*attempt, domain, settling, outcome, clock, context); !done) return done.error();
    if (Status done = use_cad(prepared, options, outcome, clock, context); !done) return done.error();
    if (Status done = measure(domain, attempt->topology, options, outcome, clock, context); !done)
        return done.error();
    name_patches(outcome.mesh, domain, context.parallel());
    add_notes(outcome, domain, outcome.notes);
    return outcome;
}

} // namespace hexopt
