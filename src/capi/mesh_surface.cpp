#include "pipeline/mesh_surface.hpp"
#include "capi/mesh_view.hpp"
#include "pipeline/mesh_keys.hpp"

#include <algorithm>
#include <memory>

/// The mesh as flat arrays, as the C interface shows it.
struct hexopt_volume {
    explicit hexopt_volume(const hexopt::HexMesh& mesh);

    std::vector<double> positions;
    std::vector<std::uint32_t> cells;
    std::vector<std::uint8_t> level;
    std::vector<std::uint32_t> hanging_vertex, hanging_master;
    std::vector<std::uint64_t> hanging_offset;
    std::vector<double> hanging_weight;
    std::vector<std::uint32_t> patch_quads, quad_patch;
    std::vector<std::string> patch_names;
};

hexopt_volume::hexopt_volume(const hexopt::HexMesh& mesh)
    : level(mesh.level), hanging_vertex(mesh.hanging.vertex), hanging_master(mesh.hanging.master),
      hanging_offset(mesh.hanging.offset.begin(), mesh.hanging.offset.end()),
      hanging_weight(mesh.hanging.weight), patch_names(mesh.patch_names) {
    positions.resize(3 * mesh.vertex_count());
    hexopt::capi::write_positions(mesh.positions, positions.data());
    for (const hexopt::Cell& cell : mesh.cells) cells.insert(cells.end(), cell.begin(), cell.end());
    level.resize(mesh.cell_count(), 0);
    for (const hexopt::BoundaryQuad& quad : mesh.boundary) {
        patch_quads.insert(patch_quads.end(), quad.vertices.begin(), quad.vertices.end());
        quad_patch.push_back(quad.patch);
    }
}

namespace hexopt::capi {

namespace {

Result<MeshOptions> read_options(const char* config) {
    MeshJob job;
    if (config)
        if (Status read = read_mesh_config_text(config, "config", job); !read) return read.error();
    if (!job.initial_mesh.empty())
        return usage_error("config", "refine.initial_mesh names a file; meshing in memory takes none");
    if (!job.feature_files.empty())
        return usage_error("config", "features.lines names files; meshing in memory takes none");
    for (const RegionTarget& region : job.options.refine.regions)
        if (!region.file.empty())
            return usage_error("config", "refine.regions names " + region.file +
                                             "; meshing in memory takes regions without files");
    if (job.options.planar == PlanarChoice::yes)
        return usage_error("config", "planar meshes are made by hexopt-gpu mesh only");
    return std::move(job.options);
}

hexopt_mesh_result convert(const MeshOutcome& outcome, double seconds) {
    const ValidityCounts& validity = outcome.after.validity;
    hexopt_mesh_result result = HEXOPT_MESH_RESULT_INIT;
    result.vertices = outcome.mesh.vertex_count();
    result.cells = outcome.mesh.cell_count();
    result.concave32 = validity.concave_cells;
    result.invalid = validity.cells - validity.valid;
    result.contacts = outcome.contacts.size();
    result.min_sj = validity.min_scaled_jacobian;
    result.mean_sj = validity.mean_scaled_jacobian;
    result.curves = outcome.fit.curves;
    result.curves_captured = outcome.fit.captured_curves;
    result.backed_off = outcome.settle.backed_off_count;
    result.max_deviation = outcome.deviation.largest();
    result.seconds = seconds;
    return result;
}

Status conclude(const MeshOutcome& outcome) {
    const ValidityCounts& after = outcome.after.validity;
    switch (outcome.verdict) {
    case ErrorCode::ok:
        return Done{};
    case ErrorCode::no_valid_mesh:
        return make_error(outcome.verdict, "mesh", "cell " + std::to_string(after.worst_cell),
                          std::to_string(std::max(after.concave_cells, after.cells - after.valid)) +
                              " cells are not valid, and the boundary touches itself in " +
                              std::to_string(outcome.contacts.size()) + " quads");
    case ErrorCode::below_target:
        return make_error(outcome.verdict, "mesh", "cell " + std::to_string(after.worst_cell),
                          "valid, but the minimum scaled Jacobian " +
                              std::to_string(after.min_scaled_jacobian) + " is below optimize.min_sj");
    default:
        return make_error(outcome.verdict, "mesh", "", "cancelled; the volume is the best state so far");
    }
}

Status run(hexopt_context& context, const hexopt_surface* surface, const char* config, hexopt_volume** volume,
           hexopt_mesh_result* result) {
    if (!volume) return usage_error("volume", "is NULL");
    *volume = nullptr;
    if (!surface) return usage_error("hexopt_surface", "is NULL");
    if (result) {
        hexopt_mesh_result known = HEXOPT_MESH_RESULT_INIT;
        if (Status fits = read_struct(result, "hexopt_mesh_result", known); !fits) return fits;
    }
    const Result<TriangleSoup> soup = copy_surface(surface);
    if (!soup) return soup.error();
    Result<MeshOptions> options = read_options(config);
    if (!options) return options.error();
    StageClock clock;
    const Result<MeshOutcome> outcome = mesh_surface(*soup, *options, clock, context.inner);
    if (!outcome) return outcome.error();
    *volume = std::make_unique<hexopt_volume>(outcome->mesh).release();
    if (result) write_struct(convert(*outcome, clock.total_seconds()), result);
    return conclude(*outcome);
}

} // namespace

} // namespace hexopt::capi

extern "C" {

hexopt_status hexopt_mesh_surface(hexopt_context* context, const hexopt_surface* surface, const char* config,
                                  hexopt_volume** volume, hexopt_mesh_result* result) {
    return hexopt::capi::guarded_call(
        context, [&] { return hexopt::capi::run(*context, surface, config, volume, result); });
}

hexopt_mesh hexopt_volume_mesh(hexopt_volume* volume) {
    hexopt_mesh mesh = HEXOPT_MESH_INIT;
    if (!volume) return mesh;
    mesh.vertex_count = volume->positions.size() / 3;
    mesh.positions = volume->positions.data();
    mesh.cell_count = volume->cells.size() / 8;
    mesh.cells = volume->cells.data();
    mesh.hanging_count = volume->hanging_vertex.size();
    mesh.hanging_vertex = volume->hanging_vertex.data();
    mesh.hanging_offset = volume->hanging_offset.data();
    mesh.hanging_master = volume->hanging_master.data();
    mesh.hanging_weight = volume->hanging_weight.data();
    mesh.patch_quad_count = volume->quad_patch.size();
    mesh.patch_quads = volume->patch_quads.data();
    mesh.quad_patch = volume->quad_patch.data();
    return mesh;
}

const uint8_t* hexopt_volume_level(const hexopt_volume* volume) {
    return volume ? volume->level.data() : nullptr;
}

uint32_t hexopt_volume_patch_count(const hexopt_volume* volume) {
    return volume ? static_cast<uint32_t>(volume->patch_names.size()) : 0;
}

const char* hexopt_volume_patch_name(const hexopt_volume* volume, uint32_t patch) {
    return patch < hexopt_volume_patch_count(volume) ? volume->patch_names[patch].c_str() : nullptr;
}

void hexopt_volume_destroy(hexopt_volume* volume) { delete volume; }

} // extern "C"
