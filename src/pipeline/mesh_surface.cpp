#include "pipeline/mesh_surface.hpp"

#include "domain/boundary_model_builder.hpp"
#include "mesh/validate_structure.hpp"
#include "pipeline/trim_rounds.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Ends of the stages' parts of the run, 0..1.
constexpr double kSurfaceEnd = 0.05, kTrimEnd = 0.2, kFitEnd = 0.35, kBufferEnd = 0.45, kOptimizeEnd = 0.92,
                 kMeasureEnd = 0.97;

void begin(Context& context, const char* stage, double low, double high) {
    context.set_progress_range(low, high);
    context.report(stage, 0);
}

/// Fits, and refines where features could not be captured, up to fit_repairs times.
Result<FittedMesh> fit_domain(RefineOutput refined, const Domain& domain, const MeshOptions& options,
                              MeshOutcome& outcome, StageClock& clock, Context& context, LeakPath* leak) {
    for (int repair = 0;; ++repair) {
        begin(context, "trim", kSurfaceEnd, kTrimEnd);
        auto trimmed = clock.run("trim", [&] {
            return trim_in_rounds(refined, domain, options.trim, outcome.trim_rounds, context, leak);
        });
        if (!trimmed) return trimmed.error();
        if (Status covered = check_coverage(*trimmed); !covered) return covered.error();
        outcome.trim = trimmed->report;
        begin(context, "fit", kTrimEnd, kFitEnd);
        auto fitted = clock.run(
            "fit", [&] { return fit_boundary(std::move(trimmed->kept), domain, options.fit, context); });
        if (!fitted) return fitted.error();
        ++outcome.fit_rounds;
        outcome.fit = fitted->report;
        std::vector<Index> again;
        for (Index cell : fitted->refine_cells) again.push_back(trimmed->kept_cell[cell]);
        std::sort(again.begin(), again.end());
        const bool may_repair = repair < options.fit_repairs && !again.empty();
        if (!may_repair || refine_cells(refined, again, context).requested == 0) {
            outcome.refine = std::move(refined.stats);
            return std::move(fitted->fitted);
        }
    }
}

void bind_surface(Domain& domain, const FittedMesh& fitted) {
    std::vector<std::array<Index, 2>> features;
    for (const FittedMesh::RidgeEdge& ridge : fitted.ridges) features.push_back({ridge.a, ridge.b});
    BoundaryModelBuilder::bind(domain.model, fitted.association, std::move(features), {},
                               kQuadTolerance_rel * domain.model.diagonal());
}

/// From patches of the domain to the input's names; quads without one take that of the nearest patch.
void name_patches(HexMesh& mesh, const Domain& domain, const Parallel& parallel) {
    parallel.for_each(mesh.boundary.size(), 1024, [&](std::size_t i) {
        BoundaryQuad& quad = mesh.boundary[i];
        if (quad.patch == kNoIndex) {
            Point centre(0);
            for (Index v : quad.vertices) centre += 0.25 * mesh.positions[v];
            quad.patch = domain.model.patch_of_triangle(domain.model.project_patch(kNoIndex, centre).element);
        }
        quad.patch = domain.patch_name[quad.patch];
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
    if (outcome.stats) notes.insert(notes.end(), outcome.stats->notes.begin(), outcome.stats->notes.end());
}

Status optimize_and_measure(FittedMesh fitted, Domain& domain, const MeshOptions& options,
                            MeshOutcome& outcome, StageClock& clock, Context& context) {
    bind_surface(domain, fitted);
    HexMesh& mesh = outcome.mesh = std::move(fitted.mesh);
    const Topology topology =
        clock.run("topology", [&] { return compute_topology(mesh, context.parallel()); });
    auto before = clock.run("quality_before", [&] { return compute_quality(mesh, topology, {}, context); });
    if (!before) return before.error();
    outcome.before = std::move(*before);
    outcome.start = mesh.positions;

    begin(context, "optimize", kBufferEnd, kOptimizeEnd);
    auto stats = clock.run("optimize", [&] {
        return settle_mesh(mesh, topology, domain.model, fitted.unfitted, options.optimize, outcome.settle,
                           context);
    });
    const bool cancelled = !stats && stats.error().code == ErrorCode::cancelled;
    if (!stats && !cancelled) return stats.error();
    if (stats) outcome.stats = std::move(*stats);

    begin(context, "measure", kOptimizeEnd, kMeasureEnd);
    Context unhurried(context.parallel().threads(), context.seed()); // measures even after a cancel
    auto after = clock.run("quality_after", [&] { return compute_quality(mesh, topology, {}, unhurried); });
    if (!after) return after.error();
    outcome.after = std::move(*after);
    auto deviation = clock.run(
        "deviation", [&] { return measure_deviation(mesh, topology, domain.model, {}, unhurried); });
    if (!deviation) return deviation.error();
    outcome.deviation = *deviation;
    outcome.contacts =
        clock.run("contacts", [&] { return find_boundary_contacts(mesh, topology, unhurried.parallel()); });
    name_patches(mesh, domain, context.parallel());
    const ValidityCounts& validity = outcome.after.validity;
    const bool is_below = options.target_min_sj && validity.min_scaled_jacobian < *options.target_min_sj;
    outcome.verdict = cancelled                                           ? ErrorCode::cancelled
                      : !validity.is_valid() || !outcome.contacts.empty() ? ErrorCode::no_valid_mesh
                      : is_below                                          ? ErrorCode::below_target
                                                                          : ErrorCode::ok;
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
    begin(context, "surface", 0, kSurfaceEnd);
    auto prepared = prepare_domain(surface, options, clock, context);
    if (!prepared) return prepared.error();
    return mesh_domain(std::move(*prepared), options, clock, context, leak);
}

Result<MeshOutcome> mesh_domain(PreparedDomain prepared, const MeshOptions& options, StageClock& clock,
                                Context& context, LeakPath* leak) {
    if (options.fit_repairs < 0 || options.fit_repairs > 5)
        return make_error(ErrorCode::usage, "fit", "", "the repairs must lie in 0..5");
    MeshOutcome outcome;
    Domain& domain = prepared.domain;
    describe_domain(prepared, outcome);
    context.set_progress_range(kSurfaceEnd, kSurfaceEnd + 0.05);
    auto refined = clock.run("refine", [&] { return refine(domain, options.refine, context); });
    if (!refined) return refined.error();
    auto fitted = fit_domain(std::move(*refined), domain, options, outcome, clock, context, leak);
    if (!fitted) return fitted.error();
    if (options.buffers) {
        begin(context, "buffer", kFitEnd, kBufferEnd);
        auto buffered = clock.run(
            "buffer", [&] { return insert_buffers(std::move(*fitted), domain, options.buffer, context); });
        if (!buffered) return buffered.error();
        outcome.buffer = std::move(buffered->report);
        *fitted = std::move(buffered->fitted);
    }
    if (Status sound = require_structure(fitted->mesh, "mesh", context.parallel()); !sound)
        return sound.error();
    Status done = optimize_and_measure(std::move(*fitted), domain, options, outcome, clock, context);
    if (!done) return done.error();
    add_notes(outcome, domain, outcome.notes);
    return outcome;
}

} // namespace hexopt
