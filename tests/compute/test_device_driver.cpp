#include "compute/backends.hpp"
#include "compute/sample_problem.hpp"
#include "io/mesh_io.hpp"
#include "stages/optimize/device_driver.hpp"
#include "support/skip.hpp"

#include <filesystem>

using namespace hexopt;
using namespace hexopt::compute;
using namespace hexopt::compute::testing;

namespace {

struct Outcome {
    std::vector<Point> positions;
    OptimizeStats stats;
    int kept = 0;
};

Outcome run_on(Backend& backend, const SampleProblem& sample, Precision precision = Precision::f64,
               int sweeps = 0) {
    Context context;
    OptimizeOptions options;
    Budget budget(options, context);
    Outcome outcome;
    outcome.positions = sample.mesh.positions;
    const DeviceTarget target{&backend, precision, sweeps};
    const Status status = optimize_on_device(
        sample.mesh, sample.topology, nullptr, options, target, outcome.positions, budget,
        [&] { ++outcome.kept; }, outcome.stats);
    INFO((status ? "" : status.error().one_line()));
    REQUIRE(status);
    outcome.stats.seconds = budget.seconds();
    return outcome;
}

DeviceQuality quality_of(const SampleProblem& sample, const std::vector<Point>& positions) {
    Context context;
    const auto cpu = create_cpu_backend(context.parallel());
    auto device = DeviceProblem::create(*cpu, Precision::f64, *sample.problem, positions);
    REQUIRE(device);
    auto solver = DeviceSolver::create(*device);
    REQUIRE(solver);
    REQUIRE((*solver)->update_lengths());
    return (*solver)->measure().value();
}

} // namespace

TEST_CASE("driver: untangles a scrambled cube on the cpu backend, in each precision") {
    const SampleProblem sample(perturbed_cube(6, 1.0));
    REQUIRE(quality_of(sample, sample.mesh.positions).bad32 > 100);
    Context context;
    for (Precision precision : {Precision::f32, Precision::f64, Precision::mixed}) {
        INFO(name_of(precision));
        const Outcome outcome = run_on(*create_cpu_backend(context.parallel()), sample, precision);
        const DeviceQuality after = quality_of(sample, outcome.positions);
        CHECK(after.bad32 == 0);
        CHECK(after.min_sj > 0.9);
        CHECK(outcome.kept > 0);
    }
}

TEST_CASE("driver: order of work, number of threads and Vulkan change no bit", "[gpu]") {
    const SampleProblem sample(bent_cube(4, 1.0, 7));
    const Parallel one(1), three(3);
    const Outcome serial = run_on(*create_cpu_backend(one, CpuOrder::serial), sample);
    CHECK(run_on(*create_cpu_backend(three, CpuOrder::parallel), sample).positions == serial.positions);
    CHECK(run_on(*create_cpu_backend(three, CpuOrder::scalar), sample).positions == serial.positions);
    CHECK(run_on(*create_cpu_backend(one, CpuOrder::shuffled), sample).positions == serial.positions);
    CHECK(run_on(*create_cpu_backend(one, CpuOrder::serial), sample, Precision::f64, 2).positions ==
          run_on(*create_cpu_backend(one, CpuOrder::shuffled), sample, Precision::f64, 2).positions);
    for (Precision precision : {Precision::f32, Precision::f64, Precision::mixed}) // scalar and packs
        CHECK(run_on(*create_cpu_backend(one, CpuOrder::serial), sample, precision, 2).positions ==
              run_on(*create_cpu_backend(one, CpuOrder::parallel), sample, precision, 2).positions);
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    CHECK(run_on(*vulkan, sample).positions == serial.positions);
}

TEST_CASE("driver: whatever submission or allocation fails, the run ends with the same bits on the CPU") {
    const SampleProblem sample(bent_cube(3, 1.0, 3));
    const Parallel one(1);
    const auto with = [&](Faults faults) { return create_cpu_backend(one, CpuOrder::serial, faults); };
    const Outcome whole = run_on(*with({}), sample);
    CHECK(whole.stats.notes.empty());
    int failures = 0;
    for (int k = 0; k < 700; k = k < 24 ? k + 1 : k + 61) {
        for (int kind = 0; kind < 3; ++kind) {
            Faults faults;
            (kind == 0 ? faults.allocation : kind == 1 ? faults.submit : faults.device_lost) = k;
            const Outcome outcome = run_on(*with(faults), sample);
            INFO("kind " << kind << ", call " << k);
            REQUIRE(outcome.positions == whole.positions);
            if (outcome.stats.notes.empty()) continue;
            ++failures;
            CHECK(outcome.stats.notes.front().find("CPU") != std::string::npos);
        }
    }
    CHECK(failures > 40);
}

TEST_CASE("driver: a lost Vulkan device ends in the CPU path", "[gpu]") {
    const SampleProblem sample(bent_cube(3, 1.0, 3));
    const Parallel one(1);
    const Outcome whole = run_on(*create_cpu_backend(one, CpuOrder::serial), sample);
    for (int k : {0, 3, 20}) {
        VulkanOptions options;
        options.faults.device_lost = k;
        const ValidatedVulkan vulkan(options);
        if (!vulkan) return;
        const Outcome outcome = run_on(*vulkan, sample);
        CHECK(outcome.positions == whole.positions);
        CHECK(outcome.stats.notes.size() == 1);
    }
}

TEST_CASE("driver: cancelling leaves the last good state") {
    const SampleProblem sample(perturbed_cube(6, 1.0));
    Context context;
    int reports = 0;
    context.set_progress_sink([&](std::string_view, double, std::string_view) {
        if (++reports == 3) context.cancel();
    });
    OptimizeOptions options;
    Budget budget(options, context);
    std::vector<Point> positions = sample.mesh.positions;
    OptimizeStats stats;
    const auto backend = create_cpu_backend(context.parallel());
    const DeviceTarget target{backend.get()};
    REQUIRE(optimize_on_device(
        sample.mesh, sample.topology, nullptr, options, target, positions, budget, [] {}, stats));
    CHECK(reports < 10);
    CHECK(quality_of(sample, positions).bad32 <= quality_of(sample, sample.mesh.positions).bad32);
}

// Figures of prototypes with the boundary fixed (minimum over the corners that can move).
TEST_CASE("driver: real meshes with the boundary fixed reach the provable minimum of bad cells", "[slow]") {
    struct Case {
        const char* file;
        double bad32, min_sj;
    };
    const auto [file, bad32, min_sj] =
        GENERATE(Case{"ho_lower_arm.vtk", 0, 0.15}, Case{"ho_mid2Fem.vtk", 1, -0.06},
                 Case{"ho_oct_bunny.vtk", 0, 0.27}, Case{"mo_fandisk.vtk", 0, 0.39},
                 Case{"mq_pave3.vtk", 0, 0.33}, Case{"ec_block.mesh", 0, 0.17});
    const std::filesystem::path path = std::filesystem::path(HEXOPT_SHARED_DATA) / "hexmeshes" / file;
    if (!std::filesystem::exists(path)) HEXOPT_SKIP("no shared meshes");
    Context context;
    auto mesh = read_mesh(path, context);
    REQUIRE(mesh);
    const SampleProblem sample(std::move(*mesh));
    const auto backend = create_cpu_backend(context.parallel());
    for (Precision precision : {Precision::f64, Precision::mixed}) {
        const Outcome outcome = run_on(*backend, sample, precision);
        const DeviceQuality after = quality_of(sample, outcome.positions);
        INFO(file << " " << name_of(precision) << ": " << outcome.stats.newton_steps
                  << " Newton steps, min SJ " << after.min_sj);
        CHECK(after.bad32 <= bad32);
        CHECK(after.min_sj >= min_sj);
    }
}
