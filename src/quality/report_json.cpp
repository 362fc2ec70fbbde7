#include "quality/report_json.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

using nlohmann::json;

json to_json(const Point& p) { return json::array({p.x, p.y, p.z}); }

json to_json(const Distribution& d) {
    return {{"count", d.count}, {"min", d.min}, {"max", d.max},    {"mean", d.mean},
            {"p0_1", d.p0_1},   {"p1", d.p1},   {"p5", d.p5},      {"p50", d.p50},
            {"p95", d.p95},     {"p99", d.p99}, {"p99_9", d.p99_9}};
}

json to_json(const Histogram& h) { return {{"low", h.low}, {"width", h.width}, {"count", h.count}}; }

json to_json(const ValidityCounts& v) {
    return {{"nonfinite_cells", v.nonfinite_cells},
            {"concave8", v.concave8_cells},
            {"concave8_tets", v.concave8_tets},
            {"concave24", v.concave24_cells},
            {"concave24_tets", v.concave24_tets},
            {"concave32", v.concave_cells},
            {"jacobian_valid", v.valid},
            {"jacobian_invalid", v.invalid},
            {"jacobian_undecided", v.undecided},
            {"is_valid", v.is_valid()}};
}

json to_json(const NeighbourVolumes& n) {
    return {{"faces", n.faces},
            {"undefined", n.undefined},
            {"max", n.max},
            {"mean", n.mean},
            {"up_to_2_4_8_16_above", n.histogram}};
}

json to_json(const ListedCell& listed) {
    const CellQuality& q = listed.quality;
    return {{"cell", listed.cell},
            {"centre", to_json(listed.centre)},
            {"scaled_jacobian", q.validity.scaled_jacobian},
            {"concave8_tets", q.validity.concave8},
            {"concave24_tets", q.validity.concave24},
            {"jacobian", name_of(q.validity.validity)},
            {"min_dihedral", q.min_dihedral},
            {"max_dihedral", q.max_dihedral},
            {"aspect_ratio", q.aspect_ratio()},
            {"volume", q.volume}};
}

} // namespace

nlohmann::json to_json(const QualityReport& r) {
    json worst = json::array();
    for (const ListedCell& cell : r.worst) worst.push_back(to_json(cell));
    json scaled_jacobian = to_json(r.scaled_jacobian);
    scaled_jacobian["worst_cell"] =
        r.validity.worst_cell == kNoIndex ? json(nullptr) : json(r.validity.worst_cell);
    scaled_jacobian["histogram"] = to_json(r.scaled_jacobian_histogram);
    return {{"vertices", r.vertices},
            {"cells", r.cells},
            {"hanging_vertices", r.hanging_vertices},
            {"boundary_faces", r.boundary_faces},
            {"box", {{"min", to_json(r.box_min)}, {"max", to_json(r.box_max)}}},
            {"validity", to_json(r.validity)},
            {"scaled_jacobian", scaled_jacobian},
            {"dihedral_deg",
             {{"min_of_cell", to_json(r.min_dihedral)},
              {"max_of_cell", to_json(r.max_dihedral)},
              {"histogram", to_json(r.dihedral_histogram)},
              {"min_of_cell_histogram", to_json(r.min_dihedral_histogram)}}},
            {"aspect_ratio", to_json(r.aspect_ratio)},
            {"edge_length", {{"min", r.min_edge}, {"max", r.max_edge}, {"mean", r.mean_edge}}},
            {"volume", to_json(r.volume)},
            {"total_volume", r.total_volume},
            {"nonpositive_volumes", r.nonpositive_volumes},
            {"neighbour_volume_ratio", to_json(r.neighbour_volumes)},
            {"worst_cells", worst}};
}

} // namespace hexopt
