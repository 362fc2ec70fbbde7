#include "compute/backends.hpp"
#include "compute/sample_problem.hpp"
#include "domain/closest_point.hpp"
#include "io/mesh_io.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/device_engine.hpp"
#include "stages/optimize/device_solver.hpp"
#include "support/skip.hpp"

#include <filesystem>
#include <glm/geometric.hpp>

using namespace hexopt;
using namespace hexopt::compute;
using namespace hexopt::compute::testing;

namespace {

const Precision kPrecisions[] = {Precision::f32, Precision::f64, Precision::mixed};

/// A mesh, its boundary as the surface, and a problem in which everything but corners moves.
struct SlidingSample {
    explicit SlidingSample(HexMesh m)
        : mesh(std::move(m)), topology(compute_topology(mesh)),
          surface(build_boundary_model(mesh, topology, {}, context).value()) {
        std::vector<std::uint8_t> movable(mesh.vertex_count());
        for (std::size_t v = 0; v < movable.size(); ++v)
            movable[v] = surface.associations()[v].kind != EntityKind::corner;
        problem = std::make_unique<Problem>(mesh, topology, movable);
    }
    Context context{1};
    HexMesh mesh;
    Topology topology;
    BoundaryModel surface;
    std::unique_ptr<Problem> problem;
};

HexMesh octree_ball(Index size = 4) {
    Context context;
    SampleOptions options;
    options.size = size;
    options.tangled = 0.2;
    return make_sample("octree-sphere", options, context).value();
}

struct Outcome {
    std::vector<Point> positions;
    OptimizeStats stats;
};

Outcome slide_on(Backend& backend, const SlidingSample& sample, OptimizeOptions options = {},
                 Precision precision = Precision::f64, int sweeps = 0) {
    Context context{1};
    Budget budget(options, context);
    Outcome outcome;
    outcome.positions = sample.mesh.positions;
    const Status status = optimize_on_device(
        sample.mesh, sample.topology, &sample.surface, options, {&backend, precision, sweeps},
        outcome.positions, budget, [] {}, outcome.stats);
    INFO((status ? "" : status.error().one_line()));
    REQUIRE(status);
    return outcome;
}

/// Slides at once.
OptimizeOptions short_run(int steps, double deviation = 0) {
    OptimizeOptions options;
    options.effort = Effort::quick;
    options.max_iterations = steps;
    options.max_deviation_rel = deviation;
    return options;
}

/// The sliders of a sample on the host.
struct HostSliders {
    HostSliders(const SlidingSample& s, Precision precision, SurfaceLimits with)
        : sample(s), limits(std::move(with)), backend(create_cpu_backend(sample.context.parallel())) {
        const DeviceFrame frame = DeviceFrame::of(sample.mesh, sample.mesh.positions, precision);
        surface = std::make_unique<DeviceSurface>(
            DeviceSurface::create(*backend, precision, frame, sample.surface).value());
        device = std::make_unique<DeviceProblem>(
            DeviceProblem::create(*backend, precision, *sample.problem, frame,
                                  DeviceSliders::find(*sample.problem, sample.surface))
                .value());
        sliders =
            std::make_unique<DeviceSliders>(DeviceSliders::create(*device, *surface, sample.surface).value());
        REQUIRE(sliders->upload(limits, sample.mesh.positions, sample.context.parallel()));
        solver = DeviceSolver::create(*device, sliders.get()).value();
    }
    std::vector<Point> project(std::vector<Point> wanted) {
        REQUIRE(device->upload_positions(wanted));
        Recorder recorder;
        sliders->project(recorder, device->points);
        REQUIRE(backend->submit(recorder));
        REQUIRE(device->download_positions(wanted));
        return wanted;
    }

    const SlidingSample& sample;
    SurfaceLimits limits;
    std::unique_ptr<Backend> backend;
    std::unique_ptr<DeviceSurface> surface;
    std::unique_ptr<DeviceProblem> device;
    std::unique_ptr<DeviceSliders> sliders;
    std::unique_ptr<DeviceSolver> solver;
};

/// Least distance from p to what a vertex is bound to, by trying all of it.
double distance_by_trying(const BoundaryModel& model, Association bound, const Point& p) {
    double least = std::numeric_limits<double>::infinity();
    if (bound.kind == EntityKind::patch) {
        const auto [first, last] = model.patch_triangles(bound.entity);
        for (Index t = first; t < last; ++t) {
            const auto& [a, b, c] = model.triangle(t);
            least = std::min(least, glm::distance(p, closest_on_triangle(p, a, b, c).point));
        }
    } else {
        for (Index s = 0; s < model.segment_count(); ++s)
            if (model.curve_of_segment(s) == bound.entity)
                least = std::min(
                    least,
                    glm::distance(p, closest_on_segment(p, model.segment(s)[0], model.segment(s)[1]).point));
    }
    return least;
}

} // namespace

TEST_CASE("sliders: closest points are those found by trying every triangle and segment") {
    const SlidingSample sample(GENERATE(0, 1) == 0 ? bent_cube(4, 0.6, 5) : octree_ball());
    std::mt19937_64 generator(3);
    const double size = sample.surface.diagonal();
    for (Precision precision : kPrecisions)
        for (double reach : {0.02, 0.5}) { // of the diagonal: near, and far beyond the surface
            std::uniform_real_distribution<double> uniform(-reach * size, reach * size);
            std::vector<Point> wanted = sample.mesh.positions;
            for (Index v : sample.problem->dof_vertex())
                wanted[v] += Point(uniform(generator), uniform(generator), uniform(generator));
            HostSliders host(sample, precision, unlimited_on_surface(sample.mesh.positions));
            const std::vector<Point> placed = host.project(wanted);
            const double tolerance = (precision == Precision::f32 ? 1e-5 : 1e-13) * size;
            for (Index v : sample.problem->dof_vertex()) {
                const Association bound = sample.surface.associations()[v];
                INFO(name_of(precision) << ", vertex " << v << ", reach " << reach);
                if (bound.kind == EntityKind::interior) {
                    CHECK(glm::distance(placed[v], wanted[v]) < tolerance);
                    continue;
                }
                const double least = distance_by_trying(sample.surface, bound, wanted[v]);
                CHECK(std::abs(glm::distance(placed[v], wanted[v]) - least) < tolerance);
                CHECK(distance_by_trying(sample.surface, bound, placed[v]) < tolerance);
            }
        }
}

TEST_CASE("sliders: limits add to the energy what the host says") {
    const SlidingSample sample(bent_cube(4, 0.6, 5));
    SurfaceLimits limits = unlimited_on_surface(sample.mesh.positions);
    for (Index v = 0; v < limits.reach.size(); ++v) {
        if (v % 2 == 0) limits.reach[v] = 0.3f;
        if (v % 3 == 0) limits.band[v] = 0.2f;
    }
    HostSliders host(sample, Precision::f64, limits);
    std::mt19937_64 generator(9);
    std::uniform_real_distribution<double> uniform(-0.4, 0.4);
    std::vector<Point> at = sample.mesh.positions;
    for (Index v : sample.problem->dof_vertex())
        at[v] += Point(uniform(generator), uniform(generator), uniform(generator));
    at = host.project(at);
    REQUIRE(host.solver->update_lengths());
    const Objective with{1e-2, 0x1p-10, 0, 0}; // exact in single precision, as kernels take it
    const SurfaceMotion motion(*sample.problem, sample.surface, host.limits, Tangents::smooth);
    double expected = 0;
    std::size_t active = 0;
    for (Index d : motion.limited()) {
        const double energy = motion.limit(d, at[sample.problem->dof_vertex()[d]]).energy;
        expected += limit_weight(with) * energy;
        active += energy > 0;
    }
    REQUIRE(active > 20);
    const double total = host.solver->evaluate(with).value().energy;
    auto free = DeviceProblem::create(*host.backend, Precision::f64, *sample.problem, host.device->frame);
    REQUIRE(free);
    REQUIRE(free->upload_positions(at));
    auto plain = DeviceSolver::create(*free);
    REQUIRE(plain);
    REQUIRE((*plain)->update_lengths());
    CHECK(total - (*plain)->evaluate(with).value().energy == Approx(expected).epsilon(1e-9));
}

TEST_CASE("sliders: how far vertices may slide follows from the positions given, not from the best so far") {
    SlidingSample sample(bent_cube(4, 0.3, 5));
    const std::vector<Point> given = sample.mesh.positions;
    const auto limits = [&] {
        return compute_surface_limits(sample.mesh, sample.topology, sample.surface, given, 0.01,
                                      sample.context.parallel());
    };
    const SurfaceLimits before = limits();
    for (std::size_t v = 0; v < given.size(); ++v) // what a run does when it finds something better
        if (!sample.topology.on_boundary[v]) sample.mesh.positions[v] += Point(0.3, -0.2, 0.1);
    const SurfaceLimits after = limits();
    CHECK(after.start == before.start);
    CHECK(after.reach == before.reach);
    CHECK(std::any_of(before.reach.begin(), before.reach.end(), [](float r) { return std::isfinite(r); }));
}

TEST_CASE("sliders: a sliding run improves, keeps the surface and leaves corners alone") {
    const SlidingSample sample(GENERATE(0, 1) == 0 ? bent_cube(4, 0.6, 5) : octree_ball());
    const Context& context = sample.context;
    for (Precision precision : kPrecisions)
        for (int sweeps : {0, 2}) {
            INFO(name_of(precision) << ", " << sweeps << " sweeps");
            const auto backend = create_cpu_backend(context.parallel());
            const Outcome outcome = slide_on(*backend, sample, short_run(60), precision, sweeps);
            HexMesh after = sample.mesh;
            after.positions = outcome.positions;
            CHECK(compute_validity(after, context.parallel()).concave_cells == 0);
            std::size_t moved = 0;
            for (Index v = 0; v < after.vertex_count(); ++v) {
                const Association bound = sample.surface.associations()[v];
                if (bound.kind == EntityKind::corner) CHECK(after.positions[v] == sample.mesh.positions[v]);
                if (bound.kind != EntityKind::patch && bound.kind != EntityKind::curve) continue;
                CHECK(sample.surface.project(bound, after.positions[v]).distance <
                      1e-12 * sample.surface.diagonal());
                moved += after.positions[v] != sample.mesh.positions[v];
            }
            CHECK(moved > 10);
        }
}

TEST_CASE("sliders: order of work, number of threads and Vulkan change no bit", "[gpu]") {
    const SlidingSample sample(GENERATE(0, 1) == 0 ? bent_cube(3, 0.6, 7) : octree_ball(2));
    const Parallel one(1), three(3);
    const ValidatedVulkan vulkan;
    for (Precision precision : kPrecisions) {
        const OptimizeOptions options = short_run(12, 0.01);
        INFO(name_of(precision));
        const auto run = [&](Backend& backend) {
            return slide_on(backend, sample, options, precision, 1).positions;
        };
        const std::vector<Point> serial = run(*create_cpu_backend(one, CpuOrder::serial));
        CHECK(serial != sample.mesh.positions);
        CHECK(run(*create_cpu_backend(three, CpuOrder::parallel)) == serial);
        CHECK(run(*create_cpu_backend(one, CpuOrder::shuffled)) == serial);
        if (vulkan) CHECK(run(*vulkan) == serial);
    }
}

TEST_CASE("sliders: whatever submission or allocation fails, the run ends with the same bits on the CPU") {
    const SlidingSample sample(bent_cube(3, 0.6, 3));
    const Parallel one(1);
    const Precision precision = GENERATE(Precision::f64, Precision::f32);
    const auto run = [&](Faults faults) {
        return slide_on(*create_cpu_backend(one, CpuOrder::serial, faults), sample, short_run(16, 0.01),
                        precision, 1);
    };
    const Outcome whole = run({});
    CHECK(whole.stats.notes.empty());
    int failures = 0;
    for (int k = 0; k < 900; k = k < 60 ? k + 7 : k + 101)
        for (int kind = 0; kind < 3; ++kind) {
            Faults faults;
            (kind == 0 ? faults.allocation : kind == 1 ? faults.submit : faults.device_lost) = k;
            const Outcome outcome = run(faults);
            INFO("kind " << kind << ", call " << k);
            REQUIRE(outcome.positions == whole.positions);
            failures += !outcome.stats.notes.empty();
        }
    CHECK(failures > 20);
}

// Sliding ends where its path leads, so that hosts and devices differ in the minimum; not in what is bad.
TEST_CASE("sliders: real meshes end as they do on the host", "[slow]") {
    const char* const file = GENERATE("ho_lower_arm.vtk", "ho_mid2Fem.vtk", "mo_fandisk.vtk", "mq_pave3.vtk");
    const std::filesystem::path path = std::filesystem::path(HEXOPT_SHARED_DATA) / "hexmeshes" / file;
    if (!std::filesystem::exists(path)) HEXOPT_SKIP("no shared meshes");
    Context context;
    auto mesh = read_mesh(path, context);
    REQUIRE(mesh);
    const Topology topology = compute_topology(*mesh);
    const auto surface = build_boundary_model(*mesh, topology, {}, context);
    REQUIRE(surface);
    HexMesh on_host = *mesh, on_device = *mesh;
    OptimizeOptions options;
    options.starts = 2; // those that begin alike: host and device go about the others in different ways
    const auto host = optimize(on_host, topology, &*surface, options, context);
    REQUIRE(host);
    const auto backend = create_cpu_backend(context.parallel());
    const DeviceTarget target{backend.get()};
    const auto device = optimize(on_device, topology, &*surface, options, context, &target);
    REQUIRE(device);
    INFO(file << ": minimum " << host->min_sj_after << " on the host, " << device->min_sj_after
              << " by kernels");
    CHECK(device->bad8_after == host->bad8_after);
    CHECK(device->bad32_after == host->bad32_after);
    CHECK(device->min_sj_after > host->min_sj_after - 0.02);
}
