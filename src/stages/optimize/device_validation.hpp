#pragma once

#include "compute/checked_backend.hpp"
#include "stages/optimize/device_solver.hpp"

namespace hexopt {

/// Runs every kernel on both backends, each on what the ones before it made of the mesh, and compares: first
/// with the boundary fixed, then with all of it moving on `surface` and, in places, near it within narrow
/// limits. Leaves the mesh alone. The list has an entry for every kernel that the mesh and the precision
/// allow.
Result<std::vector<compute::KernelDifference>>
validate_device(compute::Backend& reference, compute::Backend& tested, compute::Precision precision,
                const HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                const Budget& budget);

/// True where every result lies within what is allowed: exactly equal on a software device, else the kernel's
/// bound.
bool is_within_bounds(const std::vector<compute::KernelDifference>& differences, compute::DeviceType type);

} // namespace hexopt
