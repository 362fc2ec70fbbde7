#include "capi/device_mesh.hpp"
#include "capi/mesh_view.hpp"
#include "pipeline/improve_mesh.hpp"

#include <algorithm>

namespace hexopt::capi {

namespace {

bool in_range(double value, double low, double high) { return value >= low && value <= high; }

Result<ImproveOptions> convert(const hexopt_optimize_options& c) {
    ImproveOptions options;
    OptimizeOptions& o = options.optimize;
    const char* const kWhat = "hexopt_optimize_options";
    if (c.method != HEXOPT_METHOD_ROBUST && c.method != HEXOPT_METHOD_THESIS)
        return usage_error(kWhat, "method is unknown");
    if (c.energy < HEXOPT_ENERGY_STRUCTURAL || c.energy > HEXOPT_ENERGY_AUTOMATIC)
        return usage_error(kWhat, "energy is unknown");
    if (c.boundary != HEXOPT_BOUNDARY_FIXED && c.boundary != HEXOPT_BOUNDARY_SLIDE)
        return usage_error(kWhat, "boundary is unknown");
    if (c.decomposition != 8 && c.decomposition != 24 && c.decomposition != 32)
        return usage_error(kWhat, "decomposition must be 8, 24 or 32");
    if (!in_range(c.feature_angle_deg, 0, 180))
        return usage_error(kWhat, "feature_angle_deg must be in 0..180");
    if (!in_range(c.max_deviation_rel, 0, 0.1))
        return usage_error(kWhat, "max_deviation_rel must be in 0..0.1");
    if (!in_range(c.min_sj, -1, 1)) return usage_error(kWhat, "min_sj must be in -1..1");
    if (!(c.time_limit_s >= 0)) return usage_error(kWhat, "time_limit_s must not be negative");
    if (c.precision < HEXOPT_PRECISION_F32 || c.precision > HEXOPT_PRECISION_MIXED)
        return usage_error(kWhat, "precision is unknown");
    if (!in_range(c.feature_reach_rel, 0, 0.01))
        return usage_error(kWhat, "feature_reach_rel must be in 0..0.01");
    if (c.starts < 1 || c.starts > 4) return usage_error(kWhat, "starts must be in 1..4");
    if (c.max_iterations < 1) return usage_error(kWhat, "max_iterations must be at least 1");
    o.method = c.method == HEXOPT_METHOD_ROBUST ? OptimizeMethod::robust : OptimizeMethod::thesis;
    o.energy = static_cast<Energy>(c.energy);
    o.decomposition = c.decomposition == 8    ? Decomposition::corner8
                      : c.decomposition == 24 ? Decomposition::path24
                                              : Decomposition::all32;
    o.boundary = c.boundary == HEXOPT_BOUNDARY_FIXED ? BoundaryMode::fixed : BoundaryMode::slide;
    options.features.feature_angle_deg = c.feature_angle_deg;
    if (c.feature_segment_count > 0 && o.boundary == BoundaryMode::slide) {
        Result<FeatureLines> lines = copy_feature_lines(c.feature_segments, c.feature_segment_count);
        if (!lines) return lines.error();
        options.feature_lines.push_back(std::move(*lines));
    }
    options.feature_reach_rel = c.feature_reach_rel;
    o.starts = c.starts;
    o.max_deviation_rel = c.max_deviation_rel;
    o.min_sj = c.min_sj;
    if (c.min_sj < 1) options.target_min_sj = c.min_sj;
    if (c.time_limit_s > 0) o.time_limit_s = c.time_limit_s;
    o.max_iterations = c.max_iterations;
    if (c.device) options.compute.device = c.device;
    options.compute.precision = static_cast<compute::Precision>(c.precision);
    return options;
}

static_assert(static_cast<int>(compute::Precision::f32) == HEXOPT_PRECISION_F32);
static_assert(static_cast<int>(compute::Precision::f64) == HEXOPT_PRECISION_F64);
static_assert(static_cast<int>(compute::Precision::mixed) == HEXOPT_PRECISION_MIXED);

constexpr hexopt_optimize_options kDefaults = HEXOPT_OPTIMIZE_OPTIONS_INIT;
static_assert(kDefaults.feature_angle_deg == BoundaryOptions{}.feature_angle_deg);
static_assert(kDefaults.feature_reach_rel == ImproveOptions{}.feature_reach_rel);
static_assert(kDefaults.starts == OptimizeOptions{}.starts);
static_assert(kDefaults.max_deviation_rel == OptimizeOptions{}.max_deviation_rel);
static_assert(kDefaults.min_sj == OptimizeOptions{}.min_sj);
static_assert(kDefaults.max_iterations == OptimizeOptions{}.max_iterations);
static_assert(kDefaults.energy == static_cast<int>(OptimizeOptions{}.energy));
static_assert(static_cast<int>(Energy::structural) == HEXOPT_ENERGY_STRUCTURAL);
static_assert(static_cast<int>(Energy::regularised) == HEXOPT_ENERGY_REGULARISED);
static_assert(static_cast<int>(Energy::automatic) == HEXOPT_ENERGY_AUTOMATIC);

hexopt_optimize_result convert(const ImproveOutcome& outcome, double seconds) {
    hexopt_optimize_result result = HEXOPT_OPTIMIZE_RESULT_INIT;
    result.concave8_before = outcome.before.validity.concave8_cells;
    result.concave8_after = outcome.after.validity.concave8_cells;
    result.concave32_before = outcome.before.validity.concave_cells;
    result.concave32_after = outcome.after.validity.concave_cells;
    result.min_sj_before = outcome.before.validity.min_scaled_jacobian;
    result.min_sj_after = outcome.after.validity.min_scaled_jacobian;
    result.infeasible = outcome.stats ? outcome.stats->min_bad32 : 0;
    result.max_deviation = outcome.deviation ? outcome.deviation->largest() : 0;
    result.seconds = seconds;
    return result;
}

Status conclude(const ImproveOutcome& outcome) {
    const ValidityCounts& after = outcome.after.validity;
    switch (outcome.verdict) {
    case ErrorCode::ok:
        return Done{};
    case ErrorCode::no_valid_mesh:
        return make_error(outcome.verdict, "optimize", "cell " + std::to_string(after.worst_cell),
                          std::to_string(std::max(after.concave_cells, after.cells - after.valid)) +
                              " cells are not valid; the worst is named");
    case ErrorCode::below_target:
        return make_error(outcome.verdict, "optimize", "cell " + std::to_string(after.worst_cell),
                          "valid, but the minimum scaled Jacobian " +
                              std::to_string(after.min_scaled_jacobian) + " is below min_sj");
    default:
        return make_error(outcome.verdict, "optimize", "",
                          "cancelled; the best state so far is in positions");
    }
}

struct Request {
    ImproveOptions options;
    hexopt_optimize_result* result; ///< checked; may be null
};

Result<Request> read_request(hexopt_optimize_options known, const hexopt_optimize_options* given,
                             hexopt_optimize_result* result) {
    if (given)
        if (auto status = read_struct(given, "hexopt_optimize_options", known); !status)
            return status.error();
    hexopt_optimize_result header = HEXOPT_OPTIMIZE_RESULT_INIT;
    if (result)
        if (auto status = read_struct(result, "hexopt_optimize_result", header); !status)
            return status.error();
    Result<ImproveOptions> options = convert(known);
    if (!options) return options.error();
    return Request{std::move(*options), result};
}

/// Improves the mesh in the caller's arrays.
Status improve(hexopt_context& context, const hexopt_mesh* mesh, const Request& request) {
    Result<HexMesh> copy = copy_mesh(mesh, context.inner);
    if (!copy) return copy.error();
    StageClock clock;
    const Result<ImproveOutcome> outcome = improve_mesh(*copy, request.options, clock, context.inner);
    if (!outcome) return outcome.error();
    write_positions(copy->positions, mesh->positions);
    if (request.result) write_struct(convert(*outcome, clock.total_seconds()), request.result);
    return conclude(*outcome);
}

Status run(hexopt_context& context, const hexopt_mesh* mesh, const hexopt_surface* surface,
           const hexopt_optimize_options* given, hexopt_optimize_result* result) {
    Result<Request> request = read_request(kDefaults, given, result);
    if (!request) return request.error();
    TriangleSoup soup;
    if (surface) {
        Result<TriangleSoup> read = copy_surface(surface);
        if (!read) return read.error();
        soup = std::move(*read);
        request->options.surface = &soup;
    }
    return improve(context, mesh, *request);
}

Status run_on_device(hexopt_context& context, const hexopt_vulkan* vulkan,
                     const hexopt_device_mesh* given_mesh, const hexopt_optimize_options* given,
                     hexopt_optimize_result* result) {
    hexopt_optimize_options defaults = kDefaults;
    if (!given) defaults.boundary = HEXOPT_BOUNDARY_FIXED;
    Result<Request> request = read_request(defaults, given, result);
    if (!request) return request.error();
    Result<DeviceMesh> mesh = open_device_mesh(vulkan, given_mesh);
    if (!mesh) return mesh.error();
    request->options.compute.backend = &mesh->backend();
    hexopt_mesh view = mesh->view();
    const Status status = improve(context, &view, *request);
    const bool reached = status || status.error().code == ErrorCode::no_valid_mesh ||
                         status.error().code == ErrorCode::below_target ||
                         status.error().code == ErrorCode::cancelled;
    if (!reached) return status;
    if (auto stored = mesh->store_positions(); !stored) return stored.error();
    return status;
}

} // namespace

} // namespace hexopt::capi

extern "C" {

hexopt_status hexopt_optimize(hexopt_context* context, hexopt_mesh* mesh, const hexopt_surface* surface,
                              const hexopt_optimize_options* options, hexopt_optimize_result* result) {
    return hexopt::capi::guarded_call(
        context, [&] { return hexopt::capi::run(*context, mesh, surface, options, result); });
}

hexopt_status hexopt_optimize_on_device(hexopt_context* context, const hexopt_vulkan* vulkan,
                                        const hexopt_device_mesh* mesh,
                                        const hexopt_optimize_options* options,
                                        hexopt_optimize_result* result) {
    return hexopt::capi::guarded_call(
        context, [&] { return hexopt::capi::run_on_device(*context, vulkan, mesh, options, result); });
}

} // extern "C"
