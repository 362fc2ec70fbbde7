#include "capi/mesh_view.hpp"
#include "quality/mesh_validity.hpp"

extern "C" hexopt_status hexopt_measure(hexopt_context* context, const hexopt_mesh* mesh,
                                        hexopt_quality* quality) {
    using namespace hexopt;
    return capi::guarded_call(context, [&]() -> Status {
        if (!quality) return capi::usage_error("hexopt_quality", "is NULL");
        hexopt_quality known = HEXOPT_QUALITY_INIT;
        if (auto status = capi::read_struct(quality, "hexopt_quality", known); !status) return status.error();
        const Result<HexMesh> copy = capi::copy_mesh(mesh, context->inner);
        if (!copy) return copy.error();
        const ValidityCounts counts = compute_validity(*copy, context->inner.parallel());
        known.concave8 = counts.concave8_cells;
        known.concave32 = counts.concave_cells;
        known.valid = counts.valid;
        known.invalid = counts.invalid;
        known.undecided = counts.undecided;
        known.min_sj = counts.min_scaled_jacobian;
        known.mean_sj = counts.mean_scaled_jacobian;
        known.worst_cell = counts.worst_cell;
        capi::write_struct(known, quality);
        return Done{};
    });
}
