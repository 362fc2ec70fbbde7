#include "pipeline/improve_mesh.hpp"

#include "mesh/hanging.hpp"
#include "mesh/recognise_hanging.hpp"
#include "mesh/validate_structure.hpp"
#include "pipeline/optimize_canonically.hpp"

#include <algorithm>
#include <fmt/core.h>

namespace hexopt {

namespace {

/// Distances from the surface below this fraction of its diagonal are rounding.
constexpr double kRound_rel = 1e-9;

/// Finds hanging vertices that the mesh does not name, and puts all of them where their masters are.
Result<std::size_t> settle_hanging(HexMesh& mesh, std::vector<std::string>& notes, Context& context) {
    std::size_t found = 0;
    if (mesh.hanging.empty()) {
        Result<RecognisedHanging> recognised = recognise_hanging(mesh, {}, context.parallel());
        if (!recognised) return recognised.error();
        found = recognised->hanging.count();
        if (recognised->conflict_count > 0)
            notes.push_back(fmt::format("{} hanging vertices belong to two faces that put them in different "
                                        "places; the first one decides.",
                                        recognised->conflict_count));
        if (found > 0) {
            mesh.hanging = std::move(recognised->hanging);
            ++mesh.revision;
        }
    }
    const double deviation = max_hanging_deviation(mesh.hanging, mesh.positions);
    if (deviation > 0) {
        notes.push_back(fmt::format("Hanging vertices were up to {:.3g} away from their place and were put "
                                    "there.",
                                    deviation));
        apply_hanging(mesh, context.parallel());
    }
    return found;
}

ErrorCode verdict_of(const QualityReport& after, const ImproveOptions& options) {
    if (!after.validity.is_valid()) return ErrorCode::no_valid_mesh;
    if (options.target_min_sj && after.validity.min_scaled_jacobian < *options.target_min_sj)
        return ErrorCode::below_target;
    return ErrorCode::ok;
}

/// What does not fit between a mesh and the surface it was given.
void add_surface_notes(const AssociationReport& report, std::vector<std::string>& notes) {
    if (report.far_count > 0)
        notes.push_back(fmt::format("{} boundary vertices are far from the surface, the farthest {:.3g} away "
                                    "(vertex {}).",
                                    report.far_count, report.far_vertices.front().distance,
                                    report.far_vertices.front().vertex));
    if (report.unmatched_corners + report.unmatched_curves > 0)
        notes.push_back(
            fmt::format("{} corners and {} feature curves of the surface are followed by no edge of "
                        "the mesh.",
                        report.unmatched_corners, report.unmatched_curves));
    if (!report.unmatched_lines.empty())
        notes.push_back(fmt::format("{} feature lines are followed by no edges of the mesh: {}{}.",
                                    report.unmatched_lines.size(), report.unmatched_lines.front(),
                                    report.unmatched_lines.size() > 1 ? ", ..." : ""));
    if (report.open_edges + report.nonmanifold_edges > 0)
        notes.push_back(fmt::format("The surface has {} open and {} non-manifold edges, taken as features.",
                                    report.open_edges, report.nonmanifold_edges));
}

/// The host's code for what the device driver does not offer.
Result<ComputePlace> choose_place(const ImproveOptions& options, const Parallel& parallel) {
    const char* host_only = options.optimize.method == OptimizeMethod::thesis ? "the thesis's method"
                            : options.optimize.decomposition != Decomposition::all32
                                ? "a choice of tetrahedra"
                                : nullptr;
    if (!host_only) return open_place(options.compute, parallel);
    if (!options.compute.is_host())
        return make_error(
            ErrorCode::usage, "optimize", "",
            fmt::format("{} is computed by the host in f64 only; do without it (robust method, 32 "
                        "tetrahedra), or leave device and precision at their defaults",
                        host_only));
    ComputePlace place;
    place.reason = fmt::format("cpu: {} is computed there", host_only);
    return place;
}

Result<std::optional<BoundaryModel>> build_surface(const HexMesh& mesh, const Topology& topology,
                                                   const ImproveOptions& options,
                                                   std::vector<std::string>& notes, Context& context) {
    if (options.optimize.boundary == BoundaryMode::fixed) return std::optional<BoundaryModel>{};
    const GivenFeatures given{options.feature_lines, options.feature_reach_rel};
    Result<BoundaryModel> model =
        options.surface
            ? build_boundary_model(mesh, topology, *options.surface, options.features, context, given)
            : build_boundary_model(mesh, topology, options.features, context, given);
    if (!model) return model.error();
    if (options.surface) add_surface_notes(model->association_report(), notes);
    return std::optional<BoundaryModel>(std::move(*model));
}

/// The band bounds the distance from the surface; along it feature lines may go farther.
void note_far_features(double max_deviation_rel, ImproveOutcome& outcome) {
    const Deviation& d = *outcome.deviation;
    if (!(max_deviation_rel > 0) || !(d.feature_largest() > max_deviation_rel * d.diagonal)) return;
    outcome.notes.push_back(fmt::format(
        "Feature lines and corners moved by up to {:.3g} ({:.2g} of the diagonal), along the surface "
        "more than --max-deviation-rel lets the boundary leave it; 0 keeps them exact.",
        d.feature_largest(), d.feature_largest() / d.diagonal));
}

/// Flattens faces of the optimized mesh; its minimum stays, and so does a boundary that is fixed.
Status flatten(HexMesh& mesh, const Topology& topology, const BoundaryModel* model, ImproveOutcome& outcome,
               Context& context) {
    const double least = compute_validity(mesh, context.parallel()).min_scaled_jacobian;
    FlattenOptions how;
    how.min_sj = std::max(how.min_sj, least);
    how.last_min_sj = std::max(how.last_min_sj, least);
    how.model = model;
    how.slack_rel = kRound_rel;
    auto flattened = flatten_faces(mesh, topology, how, context);
    if (!flattened) return flattened.error();
    outcome.warped = *flattened;
    if (flattened->warped_after > 0) outcome.notes.push_back(describe_warped(*flattened));
    return Done{};
}

} // namespace

Result<ImproveOutcome> improve_mesh(HexMesh& mesh, const ImproveOptions& options, StageClock& clock,
                                    Context& context) {
    if (mesh.cells.empty())
        return make_error(ErrorCode::bad_input, "optimize", "", "the mesh has no hexahedra");
    auto restore = [&mesh, positions = mesh.positions, hanging = mesh.hanging](const Error& error) {
        mesh.positions = positions;
        mesh.hanging = hanging;
        ++mesh.revision;
        return error;
    };

    ImproveOutcome outcome;
    auto place = clock.run("device", [&] { return choose_place(options, context.parallel()); });
    if (!place) return place.error();
    outcome.device = place->reason;
    context.report("structure", 0);
    const Status sound =
        clock.run("structure", [&] { return require_structure(mesh, "optimize", context.parallel()); });
    if (!sound) return sound.error();
    context.report("hanging vertices", 0);
    auto settled = clock.run("hanging", [&] { return settle_hanging(mesh, outcome.notes, context); });
    if (!settled) return restore(settled.error());
    outcome.recognised_hanging = *settled;
    const Topology topology =
        clock.run("topology", [&] { return compute_topology(mesh, context.parallel()); });

    context.report("quality before", 0);
    auto before = clock.run("quality_before", [&] { return compute_quality(mesh, topology, {}, context); });
    if (!before) return restore(before.error());
    outcome.before = std::move(*before);

    context.report("surface", 0);
    auto surface =
        clock.run("surface", [&] { return build_surface(mesh, topology, options, outcome.notes, context); });
    if (!surface) return restore(surface.error());

    auto stats = clock.run("optimize", [&] {
        const BoundaryModel* model = surface->has_value() ? &**surface : nullptr;
        const auto target = place->target();
        const DeviceTarget* device = target ? &*target : nullptr;
        if (model && takes_canonical_form(options))
            return optimize_canonically(mesh, topology, *model, options, context, device);
        return optimize(mesh, topology, model, options.optimize, context, device);
    });
    bool cancelled = !stats && stats.error().code == ErrorCode::cancelled;
    if (!stats && !cancelled) return restore(stats.error());
    if (options.flatten && !cancelled) {
        const Status done = clock.run("flatten", [&] {
            return flatten(mesh, topology, surface->has_value() ? &**surface : nullptr, outcome, context);
        });
        cancelled = !done && done.error().code == ErrorCode::cancelled;
        if (!done && !cancelled) return restore(done.error());
    }

    context.report("quality after", 1);
    Context unhurried(context.parallel().threads(), context.seed()); // measures even after a cancel
    auto after = clock.run("quality_after", [&] { return compute_quality(mesh, topology, {}, unhurried); });
    if (!after) return restore(after.error());
    outcome.after = std::move(*after);
    if (surface->has_value()) {
        auto deviation = clock.run(
            "deviation", [&] { return measure_deviation(mesh, topology, **surface, {}, unhurried); });
        if (!deviation) return restore(deviation.error());
        outcome.deviation = *deviation;
        note_far_features(options.optimize.max_deviation_rel, outcome);
    }
    outcome.verdict = cancelled ? ErrorCode::cancelled : verdict_of(outcome.after, options);
    if (stats && !cancelled) {
        outcome.notes.insert(outcome.notes.end(), stats->notes.begin(), stats->notes.end());
        outcome.stats = std::move(*stats);
    }
    return outcome;
}

} // namespace hexopt
