#include "compute/backends.hpp"
#include "compute/checked_backend.hpp"
#include "compute/sample_problem.hpp"

#include <chrono>

using namespace hexopt;
using namespace hexopt::compute;
using namespace hexopt::compute::testing;

namespace {

const Precision kPrecisions[] = {Precision::f32, Precision::f64, Precision::mixed};

/// Everything the solver does, briefly, in an order that makes each kernel work on the results of others.
Status exercise(DeviceSolver& solver, Budget& budget) {
    if (auto s = solver.update_lengths(); !s) return s;
    if (auto r = solver.measure(); !r) return r.error();
    if (auto s = solver.sweep_newton(0.05, 1); !s) return s;
    NewtonOptions options;
    options.max_steps = 1;
    options.cg_max_iterations = 8;
    if (auto r = solver.minimise({0.05, 1e-3, 100, 0.4}, options, budget); !r) return r.error();
    if (auto r = solver.measure(); !r) return r.error();
    if (auto r = solver.sweep_raise(0.5, 0.03); !r) return r.error();
    if (auto s = solver.sweep_laplacian(false); !s) return s;
    if (auto s = solver.sweep_laplacian(true); !s) return s;
    if (auto r = solver.harmonic_start(1e-6, 8); !r) return r.error();
    return Done{};
}

} // namespace

TEST_CASE("vulkan: every kernel of the solver gives the host's bits", "[gpu]") {
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    const SampleProblem sample(perturbed_cube(6, 0.6));
    Context context;
    OptimizeOptions options;
    Budget budget(options, context);
    for (Precision precision : kPrecisions) {
        const auto cpu = create_cpu_backend(context.parallel(), CpuOrder::serial);
        const auto checked = create_checked_backend(*cpu, *vulkan);
        auto device = DeviceProblem::create(*checked, precision, *sample.problem, sample.mesh.positions);
        REQUIRE(device);
        auto solver = DeviceSolver::create(*device);
        REQUIRE(solver);
        const Status status = exercise(**solver, budget);
        INFO((status ? "" : status.error().one_line()));
        REQUIRE(status);
        for (const KernelDifference& d : checked->differences()) {
            INFO(d.kernel->name << " " << name_of(precision) << ": " << d.different_words
                                << " differ, at most " << d.largest_rel << " after " << d.dispatches
                                << " dispatches");
            CHECK(d.different_words == 0);
        }
    }
}
