#include "pipeline/archive_mesh_state.hpp"

#include "domain/drop_curves.hpp"
#include "mesh/validate_structure.hpp"

#include <algorithm>
#include <functional>

namespace hexopt {

template <>
inline constexpr bool kIsPlain<BoundaryQuad> = sizeof(BoundaryQuad) == 5 * sizeof(Index);
template <>
inline constexpr bool kIsPlain<FittedMesh::RidgeEdge> = sizeof(FittedMesh::RidgeEdge) == 3 * sizeof(Index);

// The structured bindings below name every member, so that one that is added cannot be forgotten here.

template <class A>
void archive(A& a, Hanging& value) {
    auto& [vertex, offset, master, weight] = value;
    a(vertex, offset, master, weight);
}

template <class A>
void archive(A& a, HexMesh& value) {
    auto& [positions, cells, level, hanging, boundary, patch_names, revision] = value;
    a(positions, cells, level, hanging, boundary, patch_names, revision);
}

template <class A>
void archive(A& a, Association& value) {
    auto& [kind, entity] = value;
    archive_enum(a, kind, EntityKind::hanging);
    a(entity);
}

template <class A>
void archive(A& a, FittedMesh& value) {
    auto& [mesh, association, unfitted, ridges] = value;
    a(mesh, association, unfitted, ridges);
}

template <class A, class T>
void archive(A& a, Csr<T>& value) {
    auto& [offset, item] = value;
    a(offset, item);
}

template <class A>
void archive(A& a, OptimizeStats& value) {
    auto& [bad8_before, bad8_after, bad32_before, bad32_after, min_sj_before, min_sj_after, newton_steps,
           sweeps, cg_iterations, seconds, restored_input, infeasible_cells, infeasible_groups, min_bad8,
           min_bad32, notes] = value;
    a(bad8_before, bad8_after, bad32_before, bad32_after, min_sj_before, min_sj_after, newton_steps, sweeps,
      cg_iterations, seconds, restored_input, infeasible_cells, infeasible_groups, min_bad8, min_bad32,
      notes);
}

template <class A>
void archive(A& a, RefineStats& value) {
    auto& [level_cells, split, spread, layers, balance, over_budget, repairs_over_budget, surface_size,
           base_size] = value;
    a(level_cells, split, spread, layers, balance, over_budget, repairs_over_budget, surface_size, base_size);
}

template <class A>
void archive(A& a, RefineHistory& value) {
    auto& [roots, split_node, split_mask, stats, mask, max_cells, finest_size, revision] = value;
    a(roots, split_node, split_mask, stats, mask, max_cells, finest_size, revision);
}

template <class A>
void archive(A& a, TrimReport& value) {
    auto& [octree_cells, kept_cells, cut_cells, uncertain_cells, gap_removed, manifold_removed, tips_removed,
           pits_filled, partial_filled, partial_removed, wall_cells, parts, parts_dropped, part_cells_dropped,
           kept_volume, enclosed_volume, surface_area, bare_area, first_bare, half_faces, half_edges,
           surface_quads, open_edges, nonmanifold_edges, nonmanifold_vertices] = value;
    a(octree_cells, kept_cells, cut_cells, uncertain_cells, gap_removed, manifold_removed, tips_removed,
      pits_filled, partial_filled, partial_removed, wall_cells, parts, parts_dropped, part_cells_dropped,
      kept_volume, enclosed_volume, surface_area, bare_area, first_bare, half_faces, half_edges,
      surface_quads, open_edges, nonmanifold_edges, nonmanifold_vertices);
}

template <class A>
void archive(A& a, FitReport::ReleasedCurve& value) {
    auto& [curve, reason] = value;
    a(curve);
    archive_enum(a, reason, fit::Release::small);
}

template <class A>
void archive(A& a, FitReport& value) {
    auto& [corners, curves, captured_corners, captured_curves, reroutes, released_curves, curve_length,
           followed_length, largest_distance] = value;
    a(corners, curves, captured_corners, captured_curves, reroutes, released_curves, curve_length,
      followed_length, largest_distance);
}

template <class A>
void archive(A& a, BufferCounts::RidgeCells& value) {
    auto& [below_deg, edges] = value;
    a(below_deg, edges);
}

template <class A>
void archive(A& a, BufferCounts& value) {
    auto& [cells, vertices, surface_quads, flat_quads, two_face_cells, ridge_cells] = value;
    a(cells, vertices, surface_quads, flat_quads, two_face_cells, ridge_cells);
}

template <class A>
void archive(A& a, SkippedSheet& value) {
    auto& [kind, patches, fault, vertex, position, whole] = value;
    archive_enum(a, kind, SheetKind::collar);
    archive_enum(a, fault, SheetFault::crowded);
    a(patches, vertex, position, whole);
}

template <class A>
void archive(A& a, BufferReport& value) {
    auto& [before, after, groups, spared, spared_quads, pillows, collars, passes, joined_groups, skipped] =
        value;
    a(before, after, groups, spared, spared_quads, pillows, collars, passes, joined_groups, skipped);
}

template <class A>
void archive(A& a, MeshAttempt& value) {
    auto& [fitted, topology, start, stats, trim, fit, buffer, failed, low, trial, dropped] = value;
    a(fitted, start, stats, trim, fit, buffer, failed, low, dropped); // the topology follows from the mesh
}

template <class A>
void archive(A& a, AttemptCount& value) {
    auto& [cells, failed, low, refined] = value;
    a(cells, failed, low, refined);
}

template <class A>
void archive(A& a, BareSpot& value) {
    auto& [at, cell, patch, area, cell_size, thickness, part] = value;
    a(at, cell, patch, area, cell_size, thickness, part);
}

template <class A>
void archive(A& a, BarePart& value) {
    auto& [area, depth] = value;
    a(area, depth);
}

template <class A>
void archive(A& a, TrimOutput& value) {
    auto& [kept, kept_cell, refine_cells, bare_cells, bare_spots, bare_parts, report] = value;
    a(kept, kept_cell, refine_cells, bare_cells, bare_spots, bare_parts, report);
}

template <class A>
void archive(A& a, FitOutput& value) {
    auto& [fitted, refine_cells, report] = value;
    a(fitted, refine_cells, report);
}

template <class A>
void archive(A& a, AttemptCounts& value) {
    auto& [trims, trimmed, fitted, fit_rounds, fit_repairs, optimize_s] = value;
    a(trims.count, trimmed, fitted, fit_rounds, fit_repairs, optimize_s);
}

template <class A>
void archive(A& a, BackedOffVertex& value) {
    auto& [vertex, kind, position, distance] = value;
    archive_enum(a, kind, EntityKind::hanging);
    a(vertex, position, distance);
}

template <class A>
void archive(A& a, RetreatReport& value) {
    auto& [bad_before, bad_after, touching_before, touching_after, attempts, moved, beyond_max] = value;
    a(bad_before, bad_after, touching_before, touching_after, attempts, moved, beyond_max);
}

template <class A>
void archive(A& a, SettleReport& value) {
    auto& [deviation_rel, backed_off_count, backed_off, retreat] = value;
    a(deviation_rel, backed_off_count, backed_off, retreat);
}

template <class A>
void archive(A& a, CurveCut& value) {
    a(value.curve, value.at);
}

template <class A>
void archive(A& a, StageTime& value) {
    auto& [stage, seconds, cpu_seconds, peak_memory_bytes] = value;
    a(stage, seconds, cpu_seconds, peak_memory_bytes);
}

namespace {

template <class A>
void archive_rest(A& a, MeshState& state) {
    archive_enum(a, state.phase, MeshPhase::settled);
    a(state.first_cells, state.round, state.joins, state.counts, state.attempts, state.cuts, state.narrow,
      state.dropped, state.current, state.best, state.settle);
}

bool are_below(const std::vector<Index>& list, std::size_t count) {
    return std::all_of(list.begin(), list.end(), [&](Index i) { return i < count; });
}

bool is_bound(const Association& bound, const BoundaryModel& model) {
    switch (bound.kind) {
    case EntityKind::patch:
        return bound.entity < model.patch_count();
    case EntityKind::curve:
        return bound.entity < model.curve_count();
    case EntityKind::corner:
        return bound.entity < model.corner_count();
    default:
        return true;
    }
}

bool fits(const OptimizeStats& stats, std::size_t cells) {
    const Csr<Index>& groups = stats.infeasible_groups;
    return are_below(stats.infeasible_cells, cells) && are_below(groups.item, cells) &&
           !groups.offset.empty() && groups.offset.front() == 0 &&
           std::is_sorted(groups.offset.begin(), groups.offset.end()) &&
           groups.offset.back() == groups.item.size();
}

bool is_sized(const std::vector<Point>& points, const FittedMesh& fitted) {
    return points.empty() || points.size() == fitted.mesh.vertex_count();
}

/// Whether a fitted mesh belongs to the domain; its structure aside.
bool fits(const FittedMesh& fitted, const Domain& domain) {
    const std::size_t vertices = fitted.mesh.vertex_count();
    const BoundaryModel& model = domain.model;
    return fitted.association.size() == vertices && is_sized(fitted.unfitted, fitted) &&
           std::all_of(fitted.association.begin(), fitted.association.end(),
                       [&](const Association& bound) { return is_bound(bound, model); }) &&
           std::all_of(fitted.ridges.begin(), fitted.ridges.end(),
                       [&](const FittedMesh::RidgeEdge& ridge) {
                           return ridge.a < vertices && ridge.b < vertices &&
                                  ridge.curve < model.curve_count();
                       }) &&
           std::all_of(fitted.mesh.boundary.begin(), fitted.mesh.boundary.end(),
                       [&](const BoundaryQuad& quad) {
                           return quad.patch == kNoIndex || quad.patch < model.patch_count();
                       });
}

bool fits(const FitReport& report, const Domain& domain) {
    return std::all_of(report.released_curves.begin(), report.released_curves.end(),
                       [&](const auto& released) { return released.curve < domain.model.curve_count(); });
}

bool fits(const MeshAttempt& attempt, const Domain& domain) {
    const std::size_t cells = attempt.fitted.mesh.cell_count();
    return fits(attempt.fitted, domain) && is_sized(attempt.start, attempt.fitted) &&
           fits(attempt.fit, domain) && are_below(attempt.failed, cells) && are_below(attempt.low, cells) &&
           (!attempt.stats || fits(*attempt.stats, cells));
}

/// What is known of the octree before the first attempt, which is fitted to the domain `own`.
bool fits(const AttemptCounts& counts, const HexMesh& octree, const Domain& domain, const Domain& own) {
    if (!counts.trimmed) return !counts.fitted;
    const TrimOutput& trimmed = *counts.trimmed;
    const HexMesh& kept = counts.fitted ? counts.fitted->fitted.mesh : trimmed.kept;
    const std::size_t cells = octree.cell_count();
    return trimmed.kept_cell.size() == kept.cell_count() && are_below(trimmed.kept_cell, cells) &&
           are_below(trimmed.refine_cells, cells) && are_below(trimmed.bare_cells, cells) &&
           (!trimmed.bare_spots.empty() || trimmed.report.bare_area == 0) &&
           std::all_of(trimmed.bare_spots.begin(), trimmed.bare_spots.end(),
                       [&](const BareSpot& spot) {
                           return spot.cell < cells && spot.patch < domain.model.patch_count() &&
                                  spot.part < trimmed.bare_parts.size();
                       }) &&
           (!counts.fitted || (fits(counts.fitted->fitted, own) && fits(counts.fitted->report, own) &&
                               are_below(counts.fitted->refine_cells, kept.cell_count())));
}

Error refusal(std::string reason) {
    return make_error(ErrorCode::bad_input, "checkpoint", "", std::move(reason));
}

bool are_curves_of(const Domain& domain, const std::vector<Index>& list) {
    return are_below(list, domain.model.curve_count()) &&
           std::adjacent_find(list.begin(), list.end(), std::greater_equal<>()) == list.end();
}

/// The domain without these curves; none where there are none of them.
Result<std::optional<Domain>> drop_checked(const Domain& domain, const std::vector<Index>& curves,
                                           Context& context) {
    if (!are_curves_of(domain, curves)) return refusal("its curves are not the surface's");
    if (curves.empty()) return std::optional<Domain>();
    auto left = drop_curves(domain, curves, context);
    if (!left) return left.error();
    return std::optional<Domain>(std::move(*left));
}

Status complete(std::optional<MeshAttempt>& attempt, const Domain& domain, Context& context) {
    if (!attempt) return Done{};
    const auto reduced = drop_checked(domain, attempt->dropped, context);
    if (!reduced) return reduced.error();
    if (!fits(*attempt, *reduced ? **reduced : domain)) return refusal("its mesh does not fit the surface");
    const HexMesh& mesh = attempt->fitted.mesh;
    if (Status sound = require_structure(mesh, "checkpoint", context.parallel()); !sound) return sound;
    attempt->topology = compute_topology(mesh, context.parallel());
    return Done{};
}

Status complete(const AttemptCounts& counts, const HexMesh& octree, const Domain& domain,
                const std::vector<Index>& narrow, Context& context) {
    if (!counts.trimmed && !counts.fitted) return Done{};
    const auto reduced = drop_checked(domain, narrow, context);
    if (!reduced) return reduced.error();
    if (!fits(counts, octree, domain, *reduced ? **reduced : domain))
        return refusal("what it knows of its octree does not fit that");
    const HexMesh& kept = counts.fitted ? counts.fitted->fitted.mesh : counts.trimmed->kept;
    return require_structure(kept, "checkpoint", context.parallel());
}

bool has_what_comes_next(const MeshState& state) {
    switch (state.phase) {
    case MeshPhase::refined:
        return !state.current;
    case MeshPhase::fitted:
        return state.current.has_value();
    default:
        return state.best && state.best->stats && !state.current;
    }
}

} // namespace

const char* name_of(MeshPhase phase) {
    switch (phase) {
    case MeshPhase::refined:
        return "refined";
    case MeshPhase::fitted:
        return "fitted";
    case MeshPhase::attempted:
        return "attempted";
    case MeshPhase::settled:
        return "settled";
    }
    return "unknown";
}

void write_state(ArchiveWriter& writer, const MeshState& state, const std::vector<StageTime>& times) {
    writer(times, state.octree.history());
    archive_rest(writer, const_cast<MeshState&>(state)); // the same function reads; writing changes nothing
}

Result<MeshState> read_state(ArchiveReader& reader, const Domain& given, std::vector<StageTime>& times,
                             Context& context) {
    RefineHistory history;
    reader(times, history);
    if (!reader.is_sound()) return refusal("its bytes are no state of a run");
    if (history.finest_size.size() != given.model.patch_count())
        return refusal("its sizes do not fit the surface");
    auto refined = replay_history(std::move(history), context);
    if (!refined) return refined.error();
    MeshState state(std::move(*refined));
    archive_rest(reader, state);
    if (!reader.is_sound() || !reader.at_end()) return refusal("its bytes are no state of a run");
    if (!has_what_comes_next(state) || state.round < 0 || state.joins < 0)
        return refusal("its state is not one that a run can be in");
    std::optional<Domain> split;
    if (!state.cuts.empty()) {
        auto made = split_curves(given, state.cuts, context);
        if (!made) return refusal("its curves are not the surface's");
        split = std::move(*made);
    }
    const Domain& domain = split ? *split : given;
    if (Status done =
            complete(state.counts, state.octree.open(context).octree, domain, state.narrow, context);
        !done)
        return done.error();
    if (!are_curves_of(domain, state.narrow) || !are_curves_of(domain, state.dropped) ||
        !std::includes(state.dropped.begin(), state.dropped.end(), state.narrow.begin(), state.narrow.end()))
        return refusal("its curves are not the surface's");
    for (std::optional<MeshAttempt>* attempt : {&state.current, &state.best})
        if (Status done = complete(*attempt, domain, context); !done) return done.error();
    if (state.settle.backed_off.size() > state.settle.backed_off_count)
        return refusal("its state is not one that a run can be in");
    return state;
}

} // namespace hexopt
