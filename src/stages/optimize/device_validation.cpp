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
    for (const bool blocks : {true, false})
        if (auto s = solver.sweep_newton(kEps, 1, 1.6, blocks); !s) return s;
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

/// Limits that every kind of vertex runs into: short ranges here, open bands there, the rest as it may.
SurfaceLimits narrow_limits(const HexMesh& mesh, const BoundaryModel& surface, double edge) {
    SurfaceLimits limits = unlimited_on_surface(mesh.positions);
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        if (v % 2 == 0) limits.reach[v] = static_cast<float>(0.05 * edge);
        if (v % 3 == 0 || surface.associations()[v].kind == EntityKind::corner)
            limits.band[v] = static_cast<float>(0.05 * edge);
    }
    return limits;
}

Status exercise_fixed(compute::Backend& backend, Precision precision, const HexMesh& mesh,
                      const Topology& topology, const Budget& budget) {
    std::vector<std::uint8_t> movable(mesh.vertex_count());
    for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = !topology.on_boundary[v];
    const Problem problem(mesh, topology, movable);
    auto device = DeviceProblem::create(backend, precision, problem, mesh.positions);
    if (!device) return device.error();
    auto solver = DeviceSolver::create(*device);
    if (!solver) return solver.error();
    return exercise(**solver, precision, budget);
}

Status exercise_sliding(compute::Backend& backend, Precision precision, const HexMesh& mesh,
                        const Topology& topology, const BoundaryModel& model, const Budget& budget) {
    const Problem problem(mesh, topology, std::vector<std::uint8_t>(mesh.vertex_count(), 1));
    const DeviceFrame frame = DeviceFrame::of(mesh, mesh.positions, precision);
    const auto surface = DeviceSurface::create(backend, precision, frame, model);
    if (!surface) return surface.error();
    auto device =
        DeviceProblem::create(backend, precision, problem, frame, DeviceSliders::find(problem, model));
    if (!device) return device.error();
    if (auto s = device->upload_positions(mesh.positions); !s) return s;
    auto sliders = DeviceSliders::create(*device, *surface, model);
    if (!sliders) return sliders.error();
    if (auto s = sliders->upload(narrow_limits(mesh, model, frame.unit), mesh.positions, budget.parallel());
        !s)
        return s;
    const auto made = DeviceSolver::create(*device, &*sliders);
    if (!made) return made.error();
    DeviceSolver& solver = **made;
    constexpr double kEps = 0.05;
    if (auto s = solver.update_lengths(); !s) return s;
    NewtonOptions options;
    options.max_steps = 2;
    options.cg_max_iterations = 8;
    if (auto r = solver.minimise({kEps, 1, 100, 0.4}, options, budget); !r) return r.error();
    if (auto s = solver.sweep_newton(kEps, 1); !s) return s;
    if (auto r = solver.measure(); !r) return r.error();
    if (auto r = solver.sweep_raise(0.5, 0.03); !r) return r.error();
    return Done{};
}

} // namespace

Result<std::vector<KernelDifference>> validate_device(compute::Backend& reference, compute::Backend& tested,
                                                      Precision precision, const HexMesh& mesh,
                                                      const Topology& topology, const BoundaryModel& surface,
                                                      const Budget& budget) {
    const auto checked = compute::create_checked_backend(reference, tested);
    if (auto s = exercise_fixed(*checked, precision, mesh, topology, budget); !s) return s.error();
    if (auto s = exercise_sliding(*checked, precision, mesh, topology, surface, budget); !s) return s.error();
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
