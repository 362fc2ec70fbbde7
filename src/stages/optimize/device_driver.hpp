#pragma once

#include "compute/backend.hpp"
#include "stages/optimize/budget.hpp"

#include <functional>

namespace hexopt {

/// Where and how optimize_on_device() runs.
struct DeviceTarget {
    compute::Backend* backend = nullptr; ///< used only during the call
    compute::Precision precision = compute::Precision::f64;
    int sweeps_per_round = 0; ///< coloured sweeps before the Newton steps of each round; >= 0
};

/// The default method (optimize_robust()) with its steps on a backend: harmonic start, regularised
/// untangling, sliding on `surface` (null: the boundary is fixed), max-min of single vertices and of the
/// worst neighbourhoods (docs/compute.md). The same bits on the `cpu` backend and on every device that rounds
/// correctly. Works on `positions` of the mesh, may end worse than it began, calls keep_if_better at safe
/// points. Where the device is lost or its memory does not suffice, the run goes on on the `cpu` backend from
/// the last safe point, and stats.notes and the log say so. Errors: those of the `cpu` backend only.
Status optimize_on_device(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                          const OptimizeOptions& options, const DeviceTarget& target,
                          std::vector<Point>& positions, Budget& budget,
                          const std::function<void()>& keep_if_better, OptimizeStats& stats);

} // namespace hexopt
