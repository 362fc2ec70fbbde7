#include "pipeline/settle_mesh.hpp"

#include "stages/optimize/mesh_measure.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr double kRounding_rel = 1e-9;
constexpr std::size_t kListed = 20;

void add(OptimizeStats& sum, OptimizeStats run) {
    run.bad8_before = sum.bad8_before;
    run.bad32_before = sum.bad32_before;
    run.min_sj_before = sum.min_sj_before;
    run.newton_steps += sum.newton_steps;
    run.sweeps += sum.sweeps;
    run.cg_iterations += sum.cg_iterations;
    run.seconds += sum.seconds;
    run.restored_input = run.restored_input && sum.restored_input;
    sum = std::move(run);
}

} // namespace

void find_backed_off(const HexMesh& mesh, const BoundaryModel& surface, SettleReport& report) {
    const auto bound = surface.associations();
    report.backed_off.clear();
    report.deviation_rel = 0;
    const double least = kRounding_rel * surface.diagonal();
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const EntityKind kind = bound[v].kind;
        if (kind == EntityKind::interior || kind == EntityKind::hanging) continue;
        const double distance = surface.project(bound[v], mesh.positions[v]).distance;
        if (distance > least) report.backed_off.push_back({v, kind, mesh.positions[v], distance});
    }
    report.backed_off_count = report.backed_off.size();
    std::stable_sort(
        report.backed_off.begin(), report.backed_off.end(),
        [](const BackedOffVertex& a, const BackedOffVertex& b) { return a.distance > b.distance; });
    if (!report.backed_off.empty())
        report.deviation_rel = report.backed_off.front().distance / surface.diagonal();
    if (report.backed_off.size() > kListed) report.backed_off.resize(kListed);
}

Status settle_mesh(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                   std::span<const Point> unfitted, const OptimizeOptions& options, OptimizeStats& stats,
                   SettleReport& report, Context& context, const SettleTrial* trial) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const auto seconds_left = [&] {
        return options.time_limit_s - std::chrono::duration<double>(Clock::now() - start).count();
    };
    if (trial) {
        mesh.positions = trial->positions;
        report.retreat = trial->retreat;
    } else if (seconds_left() > 0) {
        RetreatOptions back;
        back.unfitted = unfitted;
        back.max_deviation = options.max_deviation_rel * surface.diagonal();
        back.time_limit_s = seconds_left();
        report.retreat = retreat(mesh, topology, surface, back, context);
    }
    if (report.retreat.attempts > 0) {
        const MeshMeasure now = measure_mesh(mesh, mesh.positions, context.parallel());
        stats.bad8_after = now.bad8;
        stats.bad32_after = now.bad32;
        stats.min_sj_after = now.min_sj;
        stats.restored_input = false;
    }
    if (trial && trial->raised) {
        add(stats, *trial->raised);
    } else if (options.max_min && seconds_left() > 0 && !context.is_cancelled()) {
        OptimizeOptions raise = options;
        raise.time_limit_s = seconds_left();
        Result<OptimizeStats> raised = raise_settled(mesh, topology, surface, raise, context);
        if (!raised) return raised.error();
        add(stats, std::move(*raised));
    }
    find_backed_off(mesh, surface, report);
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "optimize", "",
                          "cancelled; the best state so far is kept in memory");
    return Done{};
}

} // namespace hexopt
