#include "pipeline/settle_mesh.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr double kDeviations_rel[] = {3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1};
/// Runs with one deviation, each from where the last one ended, while they help.
constexpr int kRunsAtMost = 4;
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

void find_backed_off(const HexMesh& mesh, const BoundaryModel& surface, SettleReport& report) {
    const auto bound = surface.associations();
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
    if (report.backed_off.size() > kListed) report.backed_off.resize(kListed);
}

} // namespace

Result<OptimizeStats> settle_mesh(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                                  const OptimizeOptions& options, SettleReport& report, Context& context) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    OptimizeOptions on_surface = options;
    on_surface.max_deviation_rel = 0;
    Result<OptimizeStats> stats = optimize(mesh, topology, &surface, on_surface, context);
    if (!stats) return stats;
    for (double deviation : kDeviations_rel) {
        if (report.deviation_rel >= options.max_deviation_rel) break;
        OptimizeOptions next = on_surface;
        next.max_deviation_rel = std::min(deviation, options.max_deviation_rel);
        for (int run = 0; run < kRunsAtMost && stats->bad32_after > 0; ++run) {
            next.time_limit_s =
                options.time_limit_s - std::chrono::duration<double>(Clock::now() - start).count();
            if (!(next.time_limit_s > 0)) break;
            context.log(LogLevel::debug,
                        fmt::format("{} bad cells left: they may leave the surface by {:g} of "
                                    "the diagonal",
                                    stats->bad32_after, next.max_deviation_rel));
            report.deviation_rel = next.max_deviation_rel;
            const std::size_t bad = stats->bad32_after;
            Result<OptimizeStats> again = optimize(mesh, topology, &surface, next, context);
            if (!again) return again;
            add(*stats, std::move(*again));
            if (stats->bad32_after == bad) break;
        }
    }
    find_backed_off(mesh, surface, report);
    return stats;
}

} // namespace hexopt
