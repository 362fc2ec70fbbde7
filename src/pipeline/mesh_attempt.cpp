#include "pipeline/mesh_attempt.hpp"

#include "core/freed_memory.hpp"
#include "domain/boundary_model_builder.hpp"
#include "mesh/validate_structure.hpp"
#include "pipeline/carry_positions.hpp"
#include "pipeline/mesh_progress.hpp"
#include "pipeline/refine_to_count.hpp"
#include "pipeline/repair_cells.hpp"
#include "pipeline/trim_rounds.hpp"
#include "quality/cell_quality.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace hexopt {

namespace {

constexpr std::size_t kCellChunk = 1024;

/// What is known already, which is used up, or what `make` gives.
template <class T, class Make>
Result<T> take_or(std::optional<T>& known, const Make& make) {
    if (!known) return make();
    Result<T> taken = std::move(*known);
    known.reset();
    return taken;
}

/// Whether mesh edges follow more of the features.
bool captures_more(const FitReport& a, const FitReport& b) {
    /// Part of all curves' length by which rounds differ that count as equal; then the corners decide.
    constexpr double kEqual = 1e-3;
    if (std::abs(a.followed_length - b.followed_length) > kEqual * a.curve_length)
        return a.followed_length > b.followed_length;
    return a.captured_corners > b.captured_corners;
}

/// Fits, and refines where features could not be captured while repairs are left. Finer cells may lose curves
/// that coarser ones had: the best round counts, of equally good ones the last.
Status fit_domain(OctreeStore& octree, const Domain& whole, const Domain& domain, const MeshOptions& options,
                  AttemptCounts& counts, MeshAttempt& best, StageClock& clock, Context& context,
                  LeakPath* leak) {
    RefineOutput& refined = octree.open(context);
    for (bool first = true;; first = false) {
        begin_stage(context, "trim", progress::kSurfaceEnd, progress::kTrimEnd);
        auto trimmed = take_or(counts.trimmed, [&] {
            return clock.run("trim", [&] {
                return trim_in_rounds(refined, whole, trim_options(options), options.refine.max_cells,
                                      counts.trims, context, leak);
            });
        });
        if (!trimmed) return trimmed.error();
        if (Status covered = check_coverage(*trimmed); !covered) return covered.error();
        begin_stage(context, "fit", progress::kTrimEnd, progress::kFitEnd);
        auto fitted = take_or(counts.fitted, [&] {
            return clock.run(
                "fit", [&] { return fit_boundary(std::move(trimmed->kept), domain, options.fit, context); });
        });
        if (!fitted) return fitted.error();
        ++counts.fit_rounds;
        if (first || !captures_more(best.fit, fitted->report)) {
            best.trim = trimmed->report;
            best.fit = fitted->report;
            best.fitted = std::move(fitted->fitted);
        } else {
            context.log(LogLevel::debug,
                        fmt::format("a repair of the fit lost features: {:.6g} of their length followed, "
                                    "{:.6g} before",
                                    fitted->report.followed_length, best.fit.followed_length));
        }
        std::vector<Index> again;
        for (Index cell : fitted->refine_cells) again.push_back(trimmed->kept_cell[cell]);
        if (counts.fit_repairs == options.fit_repairs || again.empty()) return Done{};
        ++counts.fit_repairs;
        // The surface also passes through cells that trimming removed, and fronts between levels are to lie
        // beside the features: their edges may not end at hanging vertices.
        if (refine_cells(refined, add_ring(refined.octree, again), context).requested == 0) return Done{};
    }
}

Status insert_layers(MeshAttempt& attempt, const Domain& domain, const MeshOptions& options,
                     StageClock& clock, Context& context) {
    begin_stage(context, "buffer", progress::kFitEnd, progress::kBufferEnd);
    auto buffered = clock.run(
        "buffer", [&] { return insert_buffers(std::move(attempt.fitted), domain, options.buffer, context); });
    if (!buffered) return buffered.error();
    for (const SkippedSheet& sheet : buffered->report.skipped)
        context.log(LogLevel::warning,
                    fmt::format("buffer: {} sheet under {} patches {} vertex {}: {}", name_of(sheet.kind),
                                sheet.patches.size(), sheet.whole ? "left out because of" : "goes round",
                                sheet.vertex, name_of(sheet.fault)));
    attempt.buffer = std::move(buffered->report);
    attempt.fitted = std::move(buffered->fitted);
    return Done{};
}

Status optimize_on_surface(MeshAttempt& attempt, const std::optional<EarlierAttempt>& earlier,
                           const Domain& domain, const MeshOptions& options, const ComputePlace& place,
                           AttemptCounts& counts, StageClock& clock, Context& context) {
    HexMesh& mesh = attempt.fitted.mesh;
    attempt.topology = clock.run("topology", [&] { return compute_topology(mesh, context.parallel()); });
    if (earlier) attempt.start = mesh.positions; // else the optimizer hands them over
    OptimizeOptions on_surface = options.optimize;
    on_surface.max_deviation_rel = 0;
    on_surface.time_limit_s = counts.optimize_s_left(options);
    begin_stage(context, "optimize", progress::kBufferEnd, progress::kOptimizeEnd);
    auto stats = clock.run("optimize", [&] {
        std::vector<std::uint8_t> carried;
        if (earlier)
            carried = carry_positions(earlier->attempt, earlier->entities, attempt, context.parallel());
        on_surface.finished_cells = carried;
        const auto target = place.target();
        return optimize(mesh, attempt.topology, &domain.model, on_surface, context,
                        target ? &*target : nullptr, earlier ? nullptr : &attempt.start);
    });
    if (attempt.start.empty()) attempt.start = mesh.positions;
    if (!stats && stats.error().code != ErrorCode::cancelled) return stats.error();
    counts.optimize_s += clock.times().back().seconds;
    if (stats) attempt.stats = std::move(*stats);
    return Done{};
}

} // namespace

void bind_surface(Domain& domain, const FittedMesh& fitted) {
    std::vector<std::array<Index, 2>> features;
    for (const FittedMesh::RidgeEdge& ridge : fitted.ridges) features.push_back({ridge.a, ridge.b});
    BoundaryModelBuilder::bind(domain.model, fitted.association, std::move(features), {},
                               kQuadTolerance_rel * domain.model.diagonal());
}

std::size_t grade_cells(MeshAttempt& attempt, const Parallel& parallel) {
    enum : std::uint8_t { fine, low, failed };
    const HexMesh& mesh = attempt.fitted.mesh;
    std::vector<std::uint8_t> state(mesh.cell_count(), fine);
    parallel.for_each(mesh.cell_count(), kCellChunk, [&](std::size_t c) {
        const CellValidity validity = compute_cell_validity(cell_points(mesh, c));
        state[c] = !validity.is_usable()                           ? failed
                   : validity.scaled_jacobian < kLowScaledJacobian ? low
                                                                   : fine;
    });
    for (Index face : find_boundary_contacts(mesh, attempt.topology, parallel))
        state[attempt.topology.boundary_faces[face].cell] = failed;
    attempt.failed.clear();
    attempt.low.clear();
    for (Index c = 0; c < mesh.cell_count(); ++c)
        if (state[c] != fine) (state[c] == low ? attempt.low : attempt.failed).push_back(c);
    return attempt.failed.size() + attempt.low.size();
}

Result<MeshAttempt> begin_attempt(OctreeStore& octree, const Domain& whole, const Domain& domain,
                                  const MeshOptions& options, AttemptCounts& counts, StageClock& clock,
                                  Context& context, LeakPath* leak) {
    MeshAttempt attempt;
    if (Status done = fit_domain(octree, whole, domain, options, counts, attempt, clock, context, leak);
        !done)
        return done.error();
    octree.put_away();
    counts.trims.memory.forget_surface();
    counts.trims.memory.set_keys({}); // until there is an octree again
    give_back_freed_memory();
    if (options.buffers)
        if (Status done = insert_layers(attempt, domain, options, clock, context); !done) return done.error();
    if (Status sound = require_structure(attempt.fitted.mesh, "mesh", context.parallel()); !sound)
        return sound.error();
    return attempt;
}

Status optimize_attempt(MeshAttempt& attempt, const std::optional<EarlierAttempt>& earlier, Domain& domain,
                        const MeshOptions& options, const ComputePlace& place, AttemptCounts& counts,
                        StageClock& clock, Context& context) {
    bind_surface(domain, attempt.fitted);
    give_back_freed_memory();
    if (Status done = optimize_on_surface(attempt, earlier, domain, options, place, counts, clock, context);
        !done)
        return done;
    clock.run("check", [&] { return grade_cells(attempt, context.parallel()); });
    return Done{};
}

} // namespace hexopt
