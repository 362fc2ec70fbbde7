#include "pipeline/optimize_pipeline.hpp"

#include "quality/report_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

using nlohmann::json;

json finite_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

const char* name_of(OptimizeMethod method) { return method == OptimizeMethod::robust ? "robust" : "thesis"; }

const char* name_of(Energy energy) {
    switch (energy) {
    case Energy::structural:
        return "structural";
    case Energy::shape:
        return "shape";
    case Energy::hyperelastic:
        return "hyperelastic";
    case Energy::automatic:
    case Energy::regularised:
        return "regularised";
    }
    return "";
}

int tets_of(Decomposition decomposition) {
    switch (decomposition) {
    case Decomposition::corner8:
        return 8;
    case Decomposition::path24:
        return 24;
    case Decomposition::all32:
        return 32;
    }
    return 0;
}

json options_json(const OptimizeJob& job) {
    const OptimizeOptions& o = job.improve.optimize;
    return {{"method", name_of(o.method)},
            {"energy", name_of(resolved_energy(o))},
            {"decomposition", tets_of(o.decomposition)},
            {"boundary", o.boundary == BoundaryMode::fixed ? "fixed" : "slide"},
            {"surface", job.surface.empty() ? json(nullptr) : json(job.surface.string())},
            {"feature_angle_deg", job.improve.features.feature_angle_deg},
            {"max_deviation_rel", o.max_deviation_rel},
            {"device", job.improve.device},
            {"precision", compute::name_of(job.improve.precision)},
            {"min_sj", job.improve.target_min_sj ? json(*job.improve.target_min_sj) : json(nullptr)},
            {"time_limit_s", finite_or_null(o.time_limit_s)},
            {"max_iterations", o.max_iterations}};
}

json stats_json(const OptimizeStats& s) {
    return {{"newton_steps", s.newton_steps},     {"sweeps", s.sweeps},
            {"cg_iterations", s.cg_iterations},   {"seconds", s.seconds},
            {"restored_input", s.restored_input}, {"infeasible_cells", s.infeasible_cells},
            {"min_concave8", s.min_bad8},         {"min_concave", s.min_bad32}};
}

json to_json(const DirectedDeviation& d) {
    return {{"largest", d.largest},
            {"upper", d.upper},
            {"rms", d.rms},
            {"at", json::array({d.at.x, d.at.y, d.at.z})}};
}

json deviation_json(const Deviation& d) {
    return {{"largest", d.largest()},
            {"largest_rel", d.largest_rel()},
            {"features_largest", d.feature_largest()},
            {"diagonal", d.diagonal},
            {"mesh_to_surface", to_json(d.mesh_to_surface)},
            {"surface_to_mesh", to_json(d.surface_to_mesh)},
            {"mesh_to_curves", to_json(d.mesh_to_curves)},
            {"curves_to_mesh", to_json(d.curves_to_mesh)}};
}

json stages_json(const std::vector<StageTime>& times) {
    json stages = json::array();
    for (const StageTime& time : times)
        stages.push_back({{"stage", time.stage},
                          {"seconds", time.seconds},
                          {"peak_memory_bytes", time.peak_memory_bytes}});
    return stages;
}

} // namespace

nlohmann::json to_json(const OptimizeJob& job, const OptimizeJobResult& result) {
    const ImproveOutcome& outcome = result.outcome;
    return {{"version", HEXOPT_VERSION_STRING},
            {"input", job.input.string()},
            {"output", job.output.string()},
            {"verdict", name_of(outcome.verdict)},
            {"exit_code", static_cast<int>(outcome.verdict)},
            {"device", outcome.device},
            {"options", options_json(job)},
            {"recognised_hanging", outcome.recognised_hanging},
            {"quality_before", to_json(outcome.before)},
            {"quality_after", to_json(outcome.after)},
            {"optimizer", outcome.stats ? stats_json(*outcome.stats) : json(nullptr)},
            {"deviation", outcome.deviation ? deviation_json(*outcome.deviation) : json(nullptr)},
            {"stages", stages_json(result.times)},
            {"notes", outcome.notes}};
}

} // namespace hexopt
