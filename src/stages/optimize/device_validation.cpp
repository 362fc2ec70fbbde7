#include "stages/optimize/device_validation.hpp"

#include <algorithm>

namespace hexopt {

using compute::KernelDifference;
using compute::Precision;

namespace {

/// Each step works on the positions that the one before it left.
Status exercise(DeviceSolver& solver, Precision precision, const Budget& budget) {
    constexpr double kEps = 0.05;
    if (auto s = solver.update_lengths(); !s) return s;
    if (auto r = solver.measure(); !r) return r.error();
    for (int energy = 0; energy < 4; ++energy)
        if (auto r = solver.compute_difference_gradient(static_cast<Energy>(energy), kEps, 1e-4); !r)
            return r.error();
    if (precision == Precision::f64)
        if (auto r = solver.sweep_untangle(0.5); !r) return r.error();
    if (auto s = solver.sweep_newton(kEps, 1); !s) return s;
    NewtonOptions options;
    options.max_steps = 1;
    options.cg_max_iterations = 8;
    if (auto r = solver.minimise({kEps, 1e-3, 100, 0.4}, options, budget); !r) return r.error();
    if (auto r = solver.measure(); !r) return r.error();
    if (auto r = solver.sweep_raise(0.5, 0.03); !r) return r.error();
    if (auto s = solver.sweep_laplacian(true); !s) return s;
    if (auto s = solver.sweep_laplacian(false); !s) return s;
    if (auto s = solver.step_hyperelastic(0.5); !s) return s;
    if (auto r = solver.harmonic_start(1e-6, 8); !r) return r.error();
    return Done{};
}

} // namespace

Result<std::vector<KernelDifference>> validate_device(compute::Backend& reference, compute::Backend& tested,
                                                      Precision precision, const Problem& problem,
                                                      std::span<const Point> positions,
                                                      const Budget& budget) {
    const auto checked = compute::create_checked_backend(reference, tested);
    auto device = DeviceProblem::create(*checked, precision, problem, positions);
    if (!device) return device.error();
    auto solver = DeviceSolver::create(*device);
    if (!solver) return solver.error();
    if (auto status = exercise(**solver, precision, budget); !status) return status.error();
    std::vector<KernelDifference> list = checked->differences();
    std::sort(list.begin(), list.end(),
              [](const auto& a, const auto& b) { return a.kernel->id < b.kernel->id; });
    return list;
}

bool is_within_bounds(const std::vector<KernelDifference>& differences, compute::DeviceType type) {
    return std::all_of(differences.begin(), differences.end(), [&](const KernelDifference& d) {
        return type == compute::DeviceType::software_gpu ? d.different_words == 0
                                                         : d.largest_rel <= d.bound();
    });
}

} // namespace hexopt
