#pragma once

#include "compute/checked_backend.hpp"
#include "stages/optimize/device_solver.hpp"

namespace hexopt {

/// Runs every kernel on both backends, each on what the ones before it made of the problem, and compares.
/// Leaves the caller's positions alone. The list has an entry for every kernel that the precision allows.
Result<std::vector<compute::KernelDifference>>
validate_device(compute::Backend& reference, compute::Backend& tested, compute::Precision precision,
                const Problem& problem, std::span<const Point> positions, const Budget& budget);

/// True where every result lies within what is allowed: exactly equal on a software device, else the kernel's
/// bound.
bool is_within_bounds(const std::vector<compute::KernelDifference>& differences, compute::DeviceType type);

} // namespace hexopt
