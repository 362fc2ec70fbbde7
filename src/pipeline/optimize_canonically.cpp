#include "pipeline/optimize_canonically.hpp"

#include "mesh/canonical_form.hpp"
#include "mesh/hanging.hpp"
#include "stages/optimize/mesh_measure.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace hexopt {

namespace {

/// A target for the minimum is passed by so much, so that rounding does not leave it below.
constexpr double kTargetMargin = 1e-4;
/// Of the deviation asked for, since the tightest box is found to within so much.
constexpr double kBoxMargin = 0.999;
/// Vertices are put onto the surface where it is no farther than so many widths of the grid.
constexpr double kOnSurface = 4;

TriangleSoup placed(const TriangleSoup& soup, const CanonicalPose& pose, const Parallel& parallel) {
    TriangleSoup result = soup;
    parallel.for_each(result.vertices.size(), 4096,
                      [&](std::size_t v) { result.vertices[v] = pose.place(soup.vertices[v]); });
    return result;
}

Result<BoundaryModel> build_model(const CanonicalForm& form, const Topology& topology,
                                  const ImproveOptions& options, Context& context) {
    if (!options.surface) return build_boundary_model(form.mesh, topology, options.features, context);
    return build_boundary_model(form.mesh, topology, placed(*options.surface, form.pose, context.parallel()),
                                options.features, context);
}

/// For the canonical form. Its box is hardly ever wider than the given one, by more than the margin: so the
/// deviation is the same length in any pose, and never more than asked for.
OptimizeOptions options_there(const ImproveOptions& options, const BoundaryModel& given,
                              const BoundaryModel& canonical, double scale) {
    OptimizeOptions there = options.optimize;
    there.max_deviation_rel *= std::min(kBoxMargin, scale * given.diagonal() / canonical.diagonal());
    there.explain_bad_cells = false; // where they lie in the given pose
    if (there.min_sj > -1) there.min_sj = std::min(1.0, there.min_sj + kTargetMargin);
    return there;
}

/// The mesh's positions where vertices have moved as far as in the canonical form; those that did not keep
/// their bits.
std::vector<Point> bring_back(const CanonicalForm& form, std::span<const Point> start,
                              const BoundaryModel& given, const HexMesh& mesh, const Parallel& parallel) {
    std::vector<Point> positions = mesh.positions;
    const double close = kOnSurface * form.pose.grid / form.pose.scale;
    parallel.for_each(positions.size(), 256, [&](std::size_t v) {
        const Index there = form.remap.vertex_old2new[v];
        const Point& reached = form.mesh.positions[there];
        if (reached == start[there]) return;
        positions[v] += form.pose.way_back(reached - start[there]);
        // The models' triangles are not the same where quads are warped.
        const Association bound = given.associations()[v];
        if (bound.kind != EntityKind::patch && bound.kind != EntityKind::curve) return;
        const Projection at = given.project(bound, positions[v]);
        if (at.distance <= close) positions[v] = at.point;
    });
    apply_hanging(mesh.hanging, positions, parallel);
    return positions;
}

/// What was counted and proved in the canonical form, for the mesh as given.
void restate(const HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
             const OptimizeOptions& options, const MeshMeasure& before, const MeshMeasure& after,
             const Parallel& parallel, OptimizeStats& stats) {
    stats.bad8_before = before.bad8;
    stats.bad32_before = before.bad32;
    stats.min_sj_before = before.min_sj;
    stats.bad8_after = after.bad8;
    stats.bad32_after = after.bad32;
    stats.min_sj_after = after.min_sj;
    if (after.bad32 > 0 && options.explain_bad_cells)
        explain_bad_cells(mesh, topology, &surface, options, parallel, stats);
}

} // namespace

bool takes_canonical_form(const ImproveOptions& options) {
    const OptimizeOptions& o = options.optimize;
    return o.boundary == BoundaryMode::slide && o.method == OptimizeMethod::robust &&
           o.effort == Effort::normal && !o.fresh_boundary && o.target_lengths.empty() &&
           options.feature_lines.empty();
}

Result<OptimizeStats> optimize_canonically(HexMesh& mesh, const Topology& topology,
                                           const BoundaryModel& surface, const ImproveOptions& options,
                                           Context& context, const DeviceTarget* device) {
    const auto begin = std::chrono::steady_clock::now();
    const Parallel& parallel = context.parallel();
    const bool is_finite = std::all_of(mesh.positions.begin(), mesh.positions.end(),
                                       [](const Point& p) { return std::isfinite(p.x + p.y + p.z); });
    if (!is_finite)
        return optimize(mesh, topology, &surface, options.optimize, context, device); // says where
    const MeshMeasure before = measure_mesh(mesh, mesh.positions, parallel);
    OptimizeOptions in_given_pose = options.optimize;
    {
        CanonicalForm form = compute_canonical_form(mesh, topology, parallel);
        const std::vector<Point> start = form.mesh.positions;
        const Topology there = compute_topology(form.mesh, parallel);
        const Result<BoundaryModel> model = build_model(form, there, options, context);
        if (!model) return model.error();
        Result<OptimizeStats> stats =
            optimize(form.mesh, there, &*model, options_there(options, surface, *model, form.pose.scale),
                     context, device);
        if (!stats && stats.error().code != ErrorCode::cancelled) return stats;
        std::vector<Point> reached = bring_back(form, start, surface, mesh, parallel);
        const MeshMeasure after = measure_mesh(mesh, reached, parallel);
        if (after.is_not_worse_than(before)) {
            mesh.positions = std::move(reached);
            if (stats) restate(mesh, topology, surface, options.optimize, before, after, parallel, *stats);
            return stats;
        }
        if (!stats) return stats;
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
        in_given_pose.time_limit_s = std::max(in_given_pose.time_limit_s - spent.count(), 1e-3);
    }
    context.log(LogLevel::info, "worse by rounding in the given pose: once more there");
    return optimize(mesh, topology, &surface, in_given_pose, context, device);
}

} // namespace hexopt
