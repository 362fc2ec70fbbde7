#include "pipeline/optimize_pipeline.hpp"

#include "pipeline/report_parts.hpp"
#include "quality/report_json.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

using nlohmann::json;
using namespace hexopt::report;

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
    json files = json::array();
    for (const auto& file : job.feature_files) files.push_back(file.string());
    return {{"method", name_of(o.method)},
            {"energy", name_of(resolved_energy(o))},
            {"decomposition", tets_of(o.decomposition)},
            {"boundary", o.boundary == BoundaryMode::fixed ? "fixed" : "slide"},
            {"surface", job.surface.empty() ? json(nullptr) : json(job.surface.string())},
            {"features", files},
            {"features_reach_rel", job.improve.feature_reach_rel},
            {"feature_angle_deg", job.improve.features.feature_angle_deg},
            {"max_deviation_rel", o.max_deviation_rel},
            {"starts", o.starts},
            {"flatten", flattens(job)},
            {"device", job.improve.compute.device},
            {"precision", compute::name_of(job.improve.compute.precision)},
            {"min_sj", job.improve.target_min_sj ? json(*job.improve.target_min_sj) : json(nullptr)},
            {"time_limit_s", finite_or_null(o.time_limit_s)},
            {"max_iterations", o.max_iterations}};
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
            {"warped_faces", outcome.warped ? warped_json(*outcome.warped) : json(nullptr)},
            {"stages", stages_json(result.times)},
            {"notes", outcome.notes}};
}

} // namespace hexopt
