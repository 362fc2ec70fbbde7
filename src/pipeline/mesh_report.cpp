#include "pipeline/mesh_keys.hpp"
#include "pipeline/report_parts.hpp"
#include "quality/report_json.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

using nlohmann::json;

json options_json(const MeshJob& job) {
    json options = json::object();
    for (const MeshKey& key : mesh_keys()) {
        std::visit([&](const auto& value) { options[key.name] = value; }, key.get(job));
        if (key.kind == MeshKey::Kind::whole)
            options[key.name] = static_cast<std::int64_t>(std::get<double>(key.get(job)));
    }
    for (const PatchTarget& patch : job.options.refine.patches) {
        const std::string prefix = "patches." + patch.patch;
        if (patch.target.level >= 0)
            options[prefix + ".level"] = patch.target.level;
        else
            options[prefix + ".size"] = patch.target.size;
    }
    return options;
}

json surface_json(const MeshOutcome& o) {
    return {{"patches", o.patches},
            {"curves", o.curves},
            {"corners", o.corners},
            {"dropped_triangles", o.dropped_triangles},
            {"open_edges", o.open_edges},
            {"nonmanifold_edges", o.nonmanifold_edges},
            {"flipped_triangles", o.orientation.flipped_triangles},
            {"sheet_triangles", o.orientation.sheet_triangles},
            {"bodies", o.orientation.bodies},
            {"cavities", o.orientation.cavities},
            {"left_out_bodies", o.left_out_bodies},
            {"followed_borders", o.followed_borders},
            {"open_pieces", o.orientation.open_pieces},
            {"open_edges_given", o.weld.open_edges_before},
            {"merged_vertices", o.weld.merged_vertices},
            {"cut_triangles", o.weld.cut_triangles}};
}

json settle_json(const SettleReport& r) {
    static constexpr const char* kKinds[] = {"interior", "patch", "curve", "corner", "hanging"};
    json worst = json::array();
    for (const BackedOffVertex& v : r.backed_off)
        worst.push_back({{"vertex", v.vertex},
                         {"bound_to", kKinds[static_cast<int>(v.kind)]},
                         {"distance", v.distance},
                         {"at", json::array({v.position.x, v.position.y, v.position.z})}});
    const RetreatReport& back = r.retreat;
    return {{"deviation_rel", r.deviation_rel},
            {"vertices", r.backed_off_count},
            {"worst", worst},
            {"retreat",
             {{"bad_before", back.bad_before},
              {"bad_after", back.bad_after},
              {"touching_before", back.touching_before},
              {"touching_after", back.touching_after},
              {"attempts", back.attempts},
              {"vertices", back.moved},
              {"beyond_max", back.beyond_max}}}};
}

json refine_json(const RefineStats& s) {
    json split = json::object(), over_budget = json::object();
    for (std::size_t c = 0; c < kCriterionCount; ++c) {
        const char* name = name_of(static_cast<RefineCriterion>(c));
        split[name] = s.split[c];
        over_budget[name] = s.over_budget[c];
    }
    return {{"level_cells", s.level_cells},
            {"split", split},
            {"split_beside", s.spread},
            {"split_layers", s.layers},
            {"split_balance", s.balance},
            {"over_budget", over_budget},
            {"repairs_over_budget", s.repairs_over_budget},
            {"surface_size", s.surface_size},
            {"base_size", s.base_size}};
}

json trim_json(const TrimReport& r, int rounds) {
    return {{"rounds", rounds},
            {"octree_cells", r.octree_cells},
            {"kept_cells", r.kept_cells},
            {"cut_cells", r.cut_cells},
            {"gap_removed", r.gap_removed},
            {"manifold_removed", r.manifold_removed},
            {"tips_removed", r.tips_removed},
            {"wall_cells", r.wall_cells},
            {"pits_filled", r.pits_filled},
            {"partial_filled", r.partial_filled},
            {"partial_removed", r.partial_removed},
            {"parts", r.parts},
            {"parts_dropped", r.parts_dropped},
            {"part_cells_dropped", r.part_cells_dropped},
            {"kept_volume", r.kept_volume},
            {"enclosed_volume", r.enclosed_volume},
            {"surface_area", r.surface_area},
            {"bare_area", r.bare_area},
            {"is_closed_manifold", r.closed_manifold()}};
}

json fit_json(const FitReport& r, int rounds, const MeshOutcome& o) {
    json released = json::array();
    for (const auto& curve : r.released_curves)
        released.push_back({{"curve", curve.curve}, {"reason", fit::name_of(curve.reason)}});
    return {{"rounds", rounds},
            {"corners", r.corners},
            {"captured_corners", r.captured_corners},
            {"curves", r.curves},
            {"captured_curves", r.captured_curves},
            {"released_curves", released},
            {"narrow_curves", o.narrow_curves},
            {"noisy_curves", o.dropped_curves},
            {"followed_length_rel", r.curve_length > 0 ? r.followed_length / r.curve_length : 1.0},
            {"reroutes", r.reroutes},
            {"largest_distance", r.largest_distance}};
}

json reach_json(const ReachReport& r) {
    return {{"corners", r.corners},
            {"corners_before", r.corners_before},
            {"corners_after", r.corners_after},
            {"followed_before_rel", r.followed_before_rel},
            {"followed_after_rel", r.followed_after_rel},
            {"off_before", r.off_before},
            {"off_after", r.off_after}};
}

json attempts_json(const std::vector<AttemptCount>& attempts) {
    json list = json::array();
    for (const AttemptCount& a : attempts)
        list.push_back({{"cells", a.cells},
                        {"failed_cells", a.failed},
                        {"low_cells", a.low},
                        {"refined_cells", a.refined}});
    return list;
}

json cad_json(const CadReport& r) {
    return {{"vertices", r.vertices},
            {"unmatched", r.unmatched},
            {"held", r.held},
            {"largest_before", r.largest_before},
            {"mean_before", r.mean_before},
            {"largest_after", r.largest_after},
            {"mean_after", r.mean_after}};
}

json counts_json(const BufferCounts& c) {
    return {{"cells", c.cells},
            {"vertices", c.vertices},
            {"surface_quads", c.surface_quads},
            {"flat_quads", c.flat_quads},
            {"two_face_cells", c.two_face_cells}};
}

json buffer_json(const BufferReport& r) {
    json skipped = json::array();
    for (const SkippedSheet& sheet : r.skipped)
        skipped.push_back({{"kind", name_of(sheet.kind)},
                           {"fault", name_of(sheet.fault)},
                           {"whole", sheet.whole},
                           {"at", json::array({sheet.position.x, sheet.position.y, sheet.position.z})}});
    return {{"before", counts_json(r.before)},
            {"after", counts_json(r.after)},
            {"groups", r.groups},
            {"spared", r.spared},
            {"pillows", r.pillows},
            {"collars", r.collars},
            {"skipped", skipped}};
}

json planar_json(const PlanarReport& r) {
    return {{"loops", r.loops},
            {"regions", r.regions.regions},
            {"dropped_regions", r.regions.dropped_regions},
            {"dropped_loops", r.regions.dropped_loops},
            {"normal", json::array({r.normal.x, r.normal.y, r.normal.z})},
            {"planes", json::array({r.low, r.high})},
            {"diagonal", r.diagonal},
            {"row_cells", r.row.cells},
            {"corners_by_cells",
             json::array({r.row.corners[1], r.row.corners[2], r.row.corners[3], r.row.corners[4]})},
            {"sweeps", r.relax.sweeps},
            {"moves", r.relax.moves},
            {"inverted_before", r.relax.before.inverted},
            {"inverted_after", r.relax.after.inverted}};
}

} // namespace

nlohmann::json to_json(const MeshJob& job, const MeshJobResult& result) {
    const MeshOutcome& o = result.outcome;
    std::string input;
    for (const auto& path : job.surfaces) input += (input.empty() ? "" : ", ") + path.string();
    return {{"version", HEXOPT_VERSION_STRING},
            {"input", input},
            {"output", job.output.string()},
            {"verdict", name_of(o.verdict)},
            {"exit_code", static_cast<int>(o.verdict)},
            {"options", options_json(job)},
            {"device", o.device.empty() ? json(nullptr) : json(o.device)},
            {"resumed_at", o.resumed.empty() ? json(nullptr) : json(o.resumed)},
            {"surface", surface_json(o)},
            {"refine", refine_json(o.refine)},
            {"trim", trim_json(o.trim, o.trim_rounds)},
            {"fit", fit_json(o.fit, o.fit_rounds, o)},
            {"buffer", o.buffer ? buffer_json(*o.buffer) : json(nullptr)},
            {"planar", o.planar ? planar_json(*o.planar) : json(nullptr)},
            {"quality_before", to_json(o.before)},
            {"quality_after", to_json(o.after)},
            {"optimizer", o.stats ? report::stats_json(*o.stats) : json(nullptr)},
            {"backed_off", settle_json(o.settle)},
            {"reached", o.reached ? reach_json(*o.reached) : json(nullptr)},
            {"attempts", attempts_json(o.attempts)},
            {"cad", o.cad ? cad_json(*o.cad) : json(nullptr)},
            {"warped_faces", o.warped ? report::warped_json(*o.warped) : json(nullptr)},
            {"boundary_contacts", o.contacts.size()},
            {"deviation", report::deviation_json(o.deviation)},
            {"stages", report::stages_json(result.times)},
            {"notes", o.notes}};
}

} // namespace hexopt
