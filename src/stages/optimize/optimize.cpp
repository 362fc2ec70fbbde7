#include "stages/optimize/optimize.hpp"

#include "domain/boundary_model.hpp"
#include "stages/optimize/cell_search.hpp"
#include "stages/optimize/device_driver.hpp"
#include "stages/optimize/infeasible.hpp"
#include "stages/optimize/mesh_measure.hpp"
#include "stages/optimize/problem.hpp"
#include "stages/optimize/robust.hpp"
#include "stages/optimize/thesis.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <utility>

namespace hexopt {

namespace {

/// Options that exclude one another: each is refused rather than ignored.
Status check_combination(const OptimizeOptions& o) {
    const auto usage = [](const char* reason) {
        return make_error(ErrorCode::usage, "optimize", "", reason);
    };
    if (!o.finished_cells.empty() && o.effort != Effort::quick)
        return usage("finished cells belong to the quick effort");
    if (o.method == OptimizeMethod::thesis) {
        if (o.boundary == BoundaryMode::slide)
            return usage(
                "the thesis method keeps the boundary fixed; fix it, or take the robust method to slide");
        if (o.max_deviation_rel > 0)
            return usage("a deviation from the surface needs a sliding boundary and the robust method");
        if (o.effort == Effort::quick) return usage("the thesis method knows no quick effort");
        if (!o.target_lengths.empty()) return usage("target lengths belong to the robust method");
        return Done{};
    }
    if (o.energy == Energy::structural || o.energy == Energy::hyperelastic)
        return usage(
            "the robust method minimises the regularised or the shape energy; the thesis method also "
            "offers structural and hyperelastic");
    if (o.untangle != UntangleTarget::deepest_point)
        return usage("the untangling target belongs to the thesis method; the robust one has none");
    if (o.gradient != GradientKind::analytic)
        return usage("gradients by finite differences belong to the thesis method");
    return Done{};
}

Status check(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
             const OptimizeOptions& o) {
    const auto usage = [](std::string reason) {
        return make_error(ErrorCode::usage, "optimize", "", std::move(reason));
    };
    if (topology.revision != mesh.revision)
        return usage("the topology belongs to another revision of the mesh");
    if (o.boundary == BoundaryMode::slide && !surface)
        return usage("sliding needs a boundary model; give one or fix the boundary");
    if (!(o.max_deviation_rel >= 0 && o.max_deviation_rel <= 0.1))
        return usage("the maximum deviation must lie in 0..0.1 of the diagonal");
    if (!(o.min_sj >= -1 && o.min_sj <= 1)) return usage("the target scaled Jacobian must lie in -1..1");
    if (!(o.time_limit_s > 0)) return usage("the time limit must be positive");
    if (o.starts < 1 || o.starts > 4) return usage("the number of starts must be in 1..4");
    if (o.max_iterations < 1) return usage("the number of iterations must be at least 1");
    if (const Status status = check_combination(o); !status) return status.error();
    if (!o.target_lengths.empty() && o.target_lengths.size() != mesh.cell_count())
        return usage("target lengths are given for " + std::to_string(o.target_lengths.size()) +
                     " cells, not " + std::to_string(mesh.cell_count()));
    if (!o.finished_cells.empty() && o.finished_cells.size() != mesh.cell_count())
        return usage("finished cells are named for " + std::to_string(o.finished_cells.size()) +
                     " cells, not " + std::to_string(mesh.cell_count()));
    for (std::size_t c = 0; c < o.target_lengths.size(); ++c) {
        const auto [least, largest] =
            std::minmax_element(o.target_lengths[c].begin(), o.target_lengths[c].end());
        if (!(*least > 0 && *largest <= 1e6 * *least))
            return usage("cell " + std::to_string(c) +
                         ": target lengths must be positive and within 1e6 of each other");
    }
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (const Point& p = mesh.positions[v]; !std::isfinite(p.x + p.y + p.z))
            return make_error(ErrorCode::bad_input, "optimize", "vertex " + std::to_string(v),
                              "position is not finite");
    return Done{};
}

} // namespace

void explain_bad_cells(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                       const OptimizeOptions& options, const Parallel& parallel, OptimizeStats& stats) {
    const bool sliding = options.boundary == BoundaryMode::slide;
    if (sliding && options.max_deviation_rel > 0) return; // every vertex may move
    std::vector<std::uint8_t> movable(mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        movable[v] =
            sliding ? surface->associations()[v].kind != EntityKind::corner : !topology.on_boundary[v];
    const std::vector<Index> bad = find_bad_cells(mesh, mesh.positions, parallel);
    Infeasibility all = prove_infeasible(mesh, topology, movable, bad, kAllTets);
    stats.min_bad8 = prove_infeasible(mesh, topology, movable, bad, kCornerTets).bound();
    stats.min_bad32 = all.bound();
    stats.infeasible_cells = std::move(all.cells);
    stats.infeasible_groups = std::move(all.groups);
    if (stats.min_bad32 == 0) return;
    stats.notes.push_back(fmt::format(
        "proved: wherever the vertices that {} go, at least {} cell{} stay{} concave ({} at a corner)",
        sliding ? "are no corners of the surface" : "are not on the boundary", stats.min_bad32,
        stats.min_bad32 == 1 ? "" : "s", stats.min_bad32 == 1 ? "s" : "", stats.min_bad8));
}

Result<OptimizeStats> optimize(HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                               const OptimizeOptions& options, Context& context, const DeviceTarget* device,
                               std::vector<Point>* replaced) {
    if (device && options.method == OptimizeMethod::thesis)
        return make_error(ErrorCode::usage, "optimize", "", "a device computes the robust method only");
    if (device && !options.target_lengths.empty())
        return make_error(ErrorCode::usage, "optimize", "",
                          "a device knows no target lengths; take the host");
    if (const Status status = check(mesh, topology, surface, options); !status) return status.error();
    Budget budget(options, context);
    OptimizeStats stats;
    const MeshMeasure input = measure_mesh(mesh, mesh.positions, context.parallel());
    stats.bad8_before = input.bad8;
    stats.bad32_before = input.bad32;
    stats.min_sj_before = input.min_sj;
    if (options.method == OptimizeMethod::robust && options.energy == Energy::shape && input.bad32 > 0)
        return make_error(
            ErrorCode::usage, "optimize", "",
            fmt::format("the shape energy needs an untangled input, but {} cells are concave; take "
                        "the regularised energy",
                        input.bad32));

    std::vector<Point> positions = mesh.positions;
    const std::vector<float> inverse_stretch = inverse_stretches(options.target_lengths);
    const auto energy_at = [&](std::span<const Point> at) {
        return inverse_stretch.empty() ? 0 : sum_of_energy(mesh, at, inverse_stretch, context.parallel());
    };
    MeshMeasure best = input;
    best.energy = energy_at(mesh.positions);
    bool improved = false;
    const auto keep_if_better = [&] {
        MeshMeasure now = measure_mesh(mesh, positions, context.parallel());
        now.energy = energy_at(positions);
        const bool admitted = options.fresh_boundary || now.is_not_worse_than(input);
        if (!admitted || !now.is_better_than(best)) return;
        best = now;
        if (replaced && !improved)
            *replaced = std::exchange(mesh.positions, positions);
        else
            mesh.positions = positions;
        improved = true;
    };
    const auto run_robust = [&]() -> Status {
        if (device)
            return optimize_on_device(mesh, topology, surface, options, *device, positions, budget,
                                      keep_if_better, stats);
        HostEngine host(budget);
        optimize_robust(mesh, topology, surface, options, host, positions, budget, keep_if_better, stats);
        return Done{};
    };
    if (options.method == OptimizeMethod::thesis)
        optimize_thesis(mesh, topology, options, positions, budget, keep_if_better, stats);
    else if (const Status status = run_robust(); !status && !context.is_cancelled())
        return status.error();

    stats.bad8_after = best.bad8;
    stats.bad32_after = best.bad32;
    stats.min_sj_after = best.min_sj;
    stats.restored_input = !improved;
    if (best.bad32 > 0 && !budget.exhausted() && !options.fresh_boundary && options.explain_bad_cells)
        explain_bad_cells(mesh, topology, surface, options, context.parallel(), stats);
    stats.seconds = budget.seconds();
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "optimize", "",
                          "cancelled; the best state so far is kept in memory");
    return stats;
}

} // namespace hexopt
