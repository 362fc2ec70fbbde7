#include "pipeline/report_parts.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace hexopt::report {

namespace {

using nlohmann::json;

json to_json(const DirectedDeviation& d) {
    return {{"largest", d.largest},
            {"upper", d.upper},
            {"rms", d.rms},
            {"at", json::array({d.at.x, d.at.y, d.at.z})}};
}

} // namespace

json finite_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json stats_json(const OptimizeStats& s) {
    return {{"newton_steps", s.newton_steps},     {"sweeps", s.sweeps},
            {"cg_iterations", s.cg_iterations},   {"seconds", s.seconds},
            {"restored_input", s.restored_input}, {"infeasible_cells", s.infeasible_cells},
            {"min_concave8", s.min_bad8},         {"min_concave", s.min_bad32}};
}

json deviation_json(const Deviation& d) {
    return {{"largest", d.largest()},
            {"largest_rel", d.largest_rel()},
            {"features_largest", d.feature_largest()},
            {"within_tenth_h_pct", d.within_tenth_h_pct},
            {"diagonal", d.diagonal},
            {"mesh_to_surface", to_json(d.mesh_to_surface)},
            {"surface_to_mesh", to_json(d.surface_to_mesh)},
            {"mesh_to_curves", to_json(d.mesh_to_curves)},
            {"curves_to_mesh", to_json(d.curves_to_mesh)}};
}

json warped_json(const FlattenReport& r) {
    return {{"before", r.warped_before},
            {"after", r.warped_after},
            {"moved_vertices", r.moved},
            {"slid_vertices", r.slid}};
}

json stages_json(const std::vector<StageTime>& times) {
    json stages = json::array();
    for (const StageTime& time : times)
        stages.push_back({{"stage", time.stage},
                          {"seconds", time.seconds},
                          {"cpu_seconds", time.cpu_seconds},
                          {"peak_memory_bytes", time.peak_memory_bytes}});
    return stages;
}

} // namespace hexopt::report
