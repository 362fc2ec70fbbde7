#include "compute/backends.hpp"
#include "compute/sample_problem.hpp"
#include "io/mesh_io.hpp"
#include "mesh/hex_reference.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/device_validation.hpp"
#include "stages/optimize/lp_kernel.hpp"

#include <algorithm>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <set>

using namespace hexopt;
using namespace hexopt::compute;
using namespace hexopt::compute::testing;

namespace {

const Precision kPrecisions[] = {Precision::f32, Precision::f64, Precision::mixed};

HexMesh sample_mesh(const char* name, double tangled, Index size = 0) {
    Context context;
    SampleOptions options;
    options.size = size;
    options.tangled = tangled;
    auto mesh = make_sample(name, options, context);
    REQUIRE(mesh);
    return std::move(*mesh);
}

/// A solver on the host with what it needs.
struct HostSolver {
    explicit HostSolver(const SampleProblem& sample, Precision precision = Precision::f64,
                        CpuOrder order = CpuOrder::serial)
        : backend(create_cpu_backend(context.parallel(), order)) {
        auto created = DeviceProblem::create(*backend, precision, *sample.problem, sample.mesh.positions);
        REQUIRE(created);
        device = std::make_unique<DeviceProblem>(std::move(*created));
        auto made = DeviceSolver::create(*device);
        REQUIRE(made);
        solver = std::move(*made);
        REQUIRE(solver->update_lengths());
    }
    std::vector<Point> positions(const SampleProblem& sample) {
        std::vector<Point> p = sample.mesh.positions;
        REQUIRE(device->download_positions(p));
        return p;
    }

    Context context{1};
    std::unique_ptr<Backend> backend;
    std::unique_ptr<DeviceProblem> device;
    std::unique_ptr<DeviceSolver> solver;
};

void check_all_kernels(Backend& tested, const SampleProblem& sample, const char* what) {
    Context context;
    const Budget budget(OptimizeOptions{}, context);
    const auto surface = build_boundary_model(sample.mesh, sample.topology, {}, context);
    REQUIRE(surface);
    std::set<std::string_view> seen;
    for (Precision precision : kPrecisions) {
        const auto cpu = create_cpu_backend(context.parallel(), CpuOrder::serial);
        const auto differences =
            validate_device(*cpu, tested, precision, sample.mesh, sample.topology, *surface, budget);
        INFO((differences ? "" : differences.error().one_line()));
        REQUIRE(differences);
        for (const KernelDifference& d : *differences) {
            seen.insert(d.kernel->name);
            INFO(what << ", " << d.kernel->name << " " << name_of(precision) << ": " << d.different_words
                      << " numbers differ, at most " << d.largest_rel);
            CHECK(d.different_words == 0);
        }
    }
    for (const KernelInfo& kernel : kernels()) {
        const bool needs_hanging = kernel.name.starts_with("constrain");
        if (sample.mesh.hanging.empty() && needs_hanging) continue;
        INFO(kernel.name);
        CHECK(seen.contains(kernel.name));
    }
}

double largest_rel(const std::vector<Point>& a, const std::vector<Point>& b) {
    double difference = 0, size = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        difference = std::max(difference, glm::length(a[i] - b[i]));
        size = std::max(size, glm::length(a[i]));
    }
    return difference / size;
}

} // namespace

TEST_CASE("a problem and its balls are the same with any number of threads") {
    const SampleProblem sample(GENERATE(0, 1) == 0 ? perturbed_cube(24, 0.2)
                                                   : sample_mesh("octree-sphere", 0.2, 12));
    REQUIRE(sample.mesh.cell_count() > 2 * 4096); // so that there are several chunks
    std::vector<std::uint8_t> movable(sample.mesh.vertex_count());
    for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = !sample.topology.on_boundary[v];
    const Parallel three(3);
    const Problem parallel(sample.mesh, sample.topology, movable, kAllTets, {}, three);
    const auto same = [](auto a, auto b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); };
    CHECK(same(parallel.cell_id(), sample.problem->cell_id()));
    CHECK(same(parallel.tet_mask(), sample.problem->tet_mask()));
    CHECK(parallel.cell_dof().offset == sample.problem->cell_dof().offset);
    CHECK(parallel.cell_dof().item == sample.problem->cell_dof().item);
    const DofBalls one_by_one = compute_dof_balls(*sample.problem);
    const DofBalls together = compute_dof_balls(parallel, three);
    CHECK(together.offset == one_by_one.offset);
    CHECK(together.item == one_by_one.item);
    CHECK(together.pattern == one_by_one.pattern);
    CHECK(together.colours.item == one_by_one.colours.item);
    CHECK((one_by_one.pattern.size() > 64) == !sample.mesh.hanging.empty());
}

TEST_CASE("kernels: Vulkan gives the host's bits on conforming cells", "[gpu]") {
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    check_all_kernels(*vulkan, SampleProblem(perturbed_cube(6, 0.6)), "cube");
}

TEST_CASE("kernels: Vulkan gives the host's bits across hanging vertices", "[gpu]") {
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    for (const char* name : {"octree-sphere", "octree-halved"})
        check_all_kernels(*vulkan, SampleProblem(sample_mesh(name, 0.2, 4)), name);
}

TEST_CASE("kernels: Vulkan gives the host's bits on real meshes", "[gpu][slow]") {
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    Context context;
    for (const char* file : {"ho_lower_armPer.vtk", "mq_pave3.vtk", "ec_block.mesh"}) {
        const std::filesystem::path path = std::filesystem::path(HEXOPT_SHARED_DATA) / "hexmeshes" / file;
        if (!std::filesystem::exists(path)) {
            std::cout << "SKIPPED: no shared meshes" << std::endl;
            return;
        }
        auto mesh = read_mesh(path, context);
        REQUIRE(mesh);
        check_all_kernels(*vulkan, SampleProblem(std::move(*mesh)), file);
    }
}

TEST_CASE("kernels: no result depends on the order of the work items, on threads or on packs") {
    const SampleProblem cube(perturbed_cube(5, 0.6)), octree(sample_mesh("octree-sphere", 0.2, 4));
    const Parallel one(1);
    const auto shuffled = create_cpu_backend(one, CpuOrder::shuffled);
    check_all_kernels(*shuffled, cube, "cube, shuffled");
    check_all_kernels(*shuffled, octree, "octree, shuffled");
    const Parallel three(3);
    const auto parallel = create_cpu_backend(three, CpuOrder::parallel);
    check_all_kernels(*parallel, cube, "cube, threads and packs");
    check_all_kernels(*parallel, octree, "octree, threads and packs");
}

TEST_CASE("kernels: in regular blocks both kernels take the same step, and blocks are found where they are") {
    const SampleProblem cube(perturbed_cube(5, 0.4)), octree(sample_mesh("octree-sphere", 0.2, 8));
    for (const SampleProblem* sample : {&cube, &octree})
        for (Precision precision : kPrecisions) {
            HostSolver general(*sample, precision), blocks(*sample, precision);
            REQUIRE(blocks.device->find_regular_blocks());
            std::uint32_t regular = 0;
            for (std::uint32_t count : blocks.device->regular_count) regular += count;
            CHECK(regular > 0);
            if (sample == &cube) CHECK(regular == cube.problem->dof_count());
            REQUIRE(general.solver->sweep_newton(0.05, 1, 1.6, false));
            REQUIRE(blocks.solver->sweep_newton(0.05, 1, 1.6, true));
            INFO(name_of(precision) << ", " << regular << " blocks");
            // Equal but for the order of sums, which a line search may answer by another length.
            const auto a = general.positions(*sample), b = blocks.positions(*sample);
            std::size_t far = 0;
            for (std::size_t v = 0; v < a.size(); ++v)
                far += glm::length(a[v] - b[v]) > (precision == Precision::f64 ? 1e-9 : 1e-3);
            CHECK(far <= a.size() / 50);
            CHECK(a != sample->mesh.positions);
        }
}

TEST_CASE("kernels: energy of boxes is the closed form, and no motion or size changes it") {
    const double a = GENERATE(1.0, 3.0), c = GENERATE(1.0, 0.2), scale = GENERATE(1.0, 1e6, 1e-6);
    HexMesh mesh = perturbed_cube(4, 0);
    for (Point& p : mesh.positions)
        p = scale * (Point(a * p.x - p.y * 0, 1.0 * p.y, c * p.z) + Point(7, -3, 11));
    const SampleProblem sample(std::move(mesh));
    const double cell = (a * a + 1 + c * c) / (3 * std::pow(a * c, 2.0 / 3));
    for (Precision precision : kPrecisions) {
        HostSolver host(sample, precision);
        const auto value = host.solver->evaluate({1e-9, 1, 0, 0});
        REQUIRE(value);
        // Tetrahedra without a free vertex do not count.
        double counted = 0;
        for (std::uint32_t mask : sample.problem->tet_mask()) counted += std::popcount(mask);
        INFO(name_of(precision));
        CHECK(value->energy == Approx(cell * counted).epsilon(precision == Precision::f64 ? 1e-12 : 1e-4));
        const double mean = (a + 1 + c) / 3;
        CHECK(value->min_jacobian == Approx(a * c / (mean * mean * mean)).epsilon(1e-4));
    }
}

TEST_CASE("kernels: the analytic gradient is that of differences of the total energy") {
    const SampleProblem sample(GENERATE(0, 1) == 0 ? perturbed_cube(4, 0.5)
                                                   : sample_mesh("octree-corner", 0.2, 2));
    const Objective objective{0.1, 1e-1, 10, 0.6};
    HostSolver host(sample);
    const auto gradient = host.solver->compute_gradient(objective);
    REQUIRE(gradient);
    const double size =
        glm::length(*std::max_element(gradient->begin(), gradient->end(),
                                      [](auto& p, auto& q) { return glm::length(p) < glm::length(q); }));
    for (Index dof = 0; dof < sample.problem->dof_count(); dof += 5)
        for (int axis = 0; axis < 3; ++axis) {
            double energy[2];
            const double h = 1e-6;
            for (int side = 0; side < 2; ++side) {
                std::vector<Point> moved = sample.mesh.positions;
                moved[sample.problem->dof_vertex()[dof]][axis] += side == 0 ? -h : h;
                sample.problem->apply_hanging(moved);
                REQUIRE(host.device->upload_positions(moved));
                energy[side] = host.solver->evaluate(objective).value().energy;
            }
            INFO("dof " << dof << " axis " << axis);
            CHECK((*gradient)[dof][axis] == Approx((energy[1] - energy[0]) / (2 * h)).margin(2e-5 * size));
        }
}

TEST_CASE("kernels: the thesis's differences agree with the analytic gradient, floats with doubles") {
    const SampleProblem sample(perturbed_cube(5, 0.2));
    HostSolver f64(sample), f32(sample, Precision::f32), mixed(sample, Precision::mixed);
    const Objective objective{0.05, 1, 0, 0};
    const auto exact = f64.solver->compute_gradient(objective).value();
    CHECK(
        largest_rel(exact, f64.solver->compute_difference_gradient(Energy::regularised, 0.05, 1e-4).value()) <
        1e-2);
    CHECK(largest_rel(exact, f32.solver->compute_gradient(objective).value()) < 1e-5);
    CHECK(largest_rel(exact, mixed.solver->compute_gradient(objective).value()) < 1e-5);
}

TEST_CASE("kernels: far from the origin mixed precision keeps its digits") {
    HexMesh near = perturbed_cube(4, 0.3), far = near;
    for (Point& p : far.positions) p += Point(1 << 20, -(1 << 20), 1 << 20);
    for (std::size_t v = 0; v < near.positions.size(); ++v)
        near.positions[v] = far.positions[v] - Point(1 << 20, -(1 << 20), 1 << 20);
    const SampleProblem a(std::move(near)), b(std::move(far));
    HostSolver here(a, Precision::mixed), there(b, Precision::mixed);
    const Objective objective{0.05, 1, 0, 0};
    CHECK(here.solver->compute_gradient(objective).value() ==
          there.solver->compute_gradient(objective).value());
}

TEST_CASE("kernels: the harmonic start puts a scrambled lattice back, also across levels") {
    for (const char* name : {"grid", "octree-corner"}) {
        INFO(name);
        Context context;
        SampleOptions options;
        options.size = 4;
        const auto lattice = make_sample(name, options, context);
        REQUIRE(lattice);
        HexMesh scrambled = *lattice;
        scramble(scrambled, compute_topology(scrambled), 5, context.parallel());
        const SampleProblem sample(std::move(scrambled));
        HostSolver host(sample);
        REQUIRE(host.solver->harmonic_start(1e-24, 400));
        const auto found = host.positions(sample);
        double worst = 0;
        for (std::size_t v = 0; v < found.size(); ++v)
            worst = std::max(worst, glm::length(found[v] - lattice->positions[v]));
        CHECK(worst < 1e-9);
    }
}

namespace {

/// Rows of a dof's linear program by evaluation: J of a tetrahedron is affine in the dof's displacement.
std::vector<HalfSpace> half_spaces_of(const SampleProblem& sample, Index dof, double& shortest) {
    const Problem& problem = *sample.problem;
    const auto jacobians = [&](const Point& d, std::size_t cell) {
        std::vector<Point> moved = sample.mesh.positions;
        moved[problem.dof_vertex()[dof]] += d;
        problem.apply_hanging(moved);
        std::vector<double> j;
        const auto edge = [&](int e) {
            const auto& ends = hex::kEdgeVertex[e];
            return moved[problem.cell(cell)[ends[1]]] - moved[problem.cell(cell)[ends[0]]];
        };
        for (const auto& tet : hex::kTetEdge)
            j.push_back(glm::dot(edge(tet[0]), glm::cross(edge(tet[1]), edge(tet[2]))));
        return j;
    };
    std::vector<HalfSpace> spaces;
    shortest = 1e30;
    for (std::size_t c = 0; c < problem.cell_count(); ++c) {
        const auto dofs = problem.cell_dof()[c];
        if (std::find(dofs.begin(), dofs.end(), dof) == dofs.end()) continue;
        double mean = 0;
        for (const auto& ends : hex::kEdgeVertex)
            mean += glm::distance(sample.mesh.positions[problem.cell(c)[ends[0]]],
                                  sample.mesh.positions[problem.cell(c)[ends[1]]]) /
                    12;
        shortest = std::min(shortest, mean);
        const auto at = jacobians(Point(0), c), x = jacobians(Point(1, 0, 0), c),
                   y = jacobians(Point(0, 1, 0), c), z = jacobians(Point(0, 0, 1), c);
        for (std::size_t t = 0; t < 32; ++t) spaces.push_back({Point(x[t], y[t], z[t]) - at[t], at[t]});
    }
    return normalised(spaces, 1e-9);
}

} // namespace

TEST_CASE("kernels: the deepest point is that of an independent linear program") {
    const SampleProblem sample(GENERATE(0, 1) == 0 ? perturbed_cube(5, 0.8)
                                                   : sample_mesh("octree-corner", 0.3, 2));
    HostSolver host(sample);
    const auto depth = host.solver->sweep_untangle(0.5);
    REQUIRE(depth);
    REQUIRE(host.device->colours[0].size() > 2);
    for (Index dof : host.device->colours[0]) { // the first colour sees the positions as they were
        double shortest = 0;
        const auto spaces = half_spaces_of(sample, dof, shortest);
        const Point half(0.5 * shortest);
        const double expected = find_deepest_point(spaces, {-half, half}, 1).depth;
        CHECK((*depth)[dof] * shortest == Approx(expected).epsilon(1e-8).margin(1e-10));
    }
}

TEST_CASE("kernels: Laplacian passes flatten a lattice's noise; the smart one never makes the worst worse") {
    const SampleProblem sample(perturbed_cube(5, 0.4));
    HostSolver plain(sample), smart(sample);
    for (int pass = 0; pass < 120; ++pass) REQUIRE(plain.solver->sweep_laplacian(false));
    const auto flat = plain.positions(sample);
    double worst = 0;
    for (const Point& p : flat) worst = std::max(worst, glm::length(p - glm::round(p)));
    CHECK(worst < 1e-6);
    double before = smart.solver->measure().value().min_sj;
    for (int pass = 0; pass < 10; ++pass) {
        REQUIRE(smart.solver->sweep_laplacian(true));
        const double after = smart.solver->measure().value().min_sj;
        CHECK(after >= before);
        before = after;
    }
}

TEST_CASE("kernels: hyper-elastic steps untangle a bent lattice and leave a straight one alone") {
    const SampleProblem straight(perturbed_cube(4, 0)), bent(perturbed_cube(5, 0.45));
    HostSolver still(straight), moving(bent);
    REQUIRE(still.solver->step_hyperelastic(1));
    CHECK(largest_rel(straight.mesh.positions, still.positions(straight)) < 1e-12);
    for (int step = 0; step < 200; ++step) REQUIRE(moving.solver->step_hyperelastic(0.3));
    CHECK(moving.solver->measure().value().min_sj > 0.99);
}

TEST_CASE("kernels: max-min raises the worst corner and tangles nothing") {
    const SampleProblem sample(perturbed_cube(6, 0.3));
    HostSolver host(sample);
    const DeviceQuality before = host.solver->measure().value();
    REQUIRE(before.bad32 == 0);
    for (int sweep = 0; sweep < 20; ++sweep) {
        REQUIRE(host.solver->measure());
        REQUIRE(host.solver->sweep_raise(0.05, 0.03));
    }
    const DeviceQuality after = host.solver->measure().value();
    CHECK(after.bad32 == 0);
    CHECK(after.min_sj > before.min_sj + 0.05);
}
