#pragma once

#include "domain/boundary_model.hpp"
#include "stages/optimize/device_problem.hpp"

namespace hexopt {

/// A surface on a backend, with a tree of boxes for each patch, curve and corner: struct Surface in
/// shaders/dialect/kernel_surface.glsl.
struct DeviceSurface {
    static Result<DeviceSurface> create(compute::Backend& backend, compute::Precision precision,
                                        const DeviceFrame& frame, const BoundaryModel& model);

    /// Nodes [first, end) of what a vertex is bound to; not for interior and hanging ones.
    std::array<std::uint32_t, 2> nodes(Association bound_to) const;
    /// Number of an element here, given what BoundaryModel::project() calls it.
    std::uint32_t element_of(Association bound_to, Index number) const;

    compute::Buffer box, link, element;
    std::vector<std::array<std::uint32_t, 2>> patch_nodes, curve_nodes;
    std::uint32_t first_segment = 0, first_corner = 0, first_corner_node = 0;
};

} // namespace hexopt
