// What one vertex update of the coloured Newton method costs: search direction and the energies at six
// lengths over the 32-tet ball of a regular vertex, in CPU nanoseconds over all threads (of the wall's clock
// on a real GPU). Compares the obvious way (scalar, double, finite differences of thesis 4.24, std::pow,
// positions fetched at every evaluation) with the kernels. Usage:
//   LP_NUM_THREADS=1 bench_kernels [cells along an edge, default 40]
#include "compute/sample_problem.hpp"
#include "compute/vulkan/vulkan_backend.hpp"
#include "dialect/prelude.hpp"
#include "mesh/hex_reference.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <glm/geometric.hpp>

using namespace hexopt;
using namespace hexopt::compute;
using namespace hexopt::compute::testing;

namespace {

constexpr double kEps = 0.05;

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// ---- the obvious reference

double tet_energy(const Point& a, const Point& b, const Point& c) {
    const double j = glm::dot(a, glm::cross(b, c));
    const double chi = 0.5 * (j + std::sqrt(j * j + kEps * kEps));
    return (glm::dot(a, a) + glm::dot(b, b) + glm::dot(c, c)) / (3 * std::pow(chi, 2.0 / 3));
}

double ball_energy(const SampleProblem& sample, const std::vector<Point>& positions, Index vertex) {
    double sum = 0;
    for (const CellCorner& corner : sample.topology.vertex_cell[vertex]) {
        const Cell& cell = sample.mesh.cells[corner.cell];
        for (const auto& tet : hex::kTetEdge) {
            bool touches = false;
            Point e[3];
            for (int k = 0; k < 3; ++k) {
                const auto& ends = hex::kEdgeVertex[tet[static_cast<std::size_t>(k)]];
                e[k] = positions[cell[ends[1]]] - positions[cell[ends[0]]];
                touches = touches || ends[0] == corner.corner || ends[1] == corner.corner;
            }
            if (touches) sum += tet_energy(e[0], e[1], e[2]);
        }
    }
    return sum;
}

void obvious_update(const SampleProblem& sample, std::vector<Point>& positions, Index vertex) {
    constexpr double kStep = 1e-4;
    const Point start = positions[vertex];
    const double here = ball_energy(sample, positions, vertex);
    Point gradient(0);
    for (int axis = 0; axis < 3; ++axis) {
        positions[vertex][axis] += kStep;
        gradient[axis] = (ball_energy(sample, positions, vertex) - here) / kStep;
        positions[vertex] = start;
    }
    Point best = start;
    double least = here, length = 1.6 * 0.1 / (glm::length(gradient) + 1e-30);
    for (int trial = 0; trial < 6; ++trial, length *= trial == 1 ? 1 / 1.6 : 0.4) {
        positions[vertex] = start - length * gradient;
        const double energy = ball_energy(sample, positions, vertex);
        if (energy < least) least = energy, best = positions[vertex];
    }
    positions[vertex] = best;
}

double time_obvious(const SampleProblem& sample) {
    std::vector<Point> positions = sample.mesh.positions;
    const std::size_t count = std::min<std::size_t>(sample.problem->dof_count(), 8000);
    const double start = cpu_seconds();
    for (std::size_t d = 0; d < count; ++d)
        obvious_update(sample, positions, sample.problem->dof_vertex()[d]);
    return (cpu_seconds() - start) / static_cast<double>(count) * 1e9;
}

// ---- the kernels

/// CPU time where the host's cores compute, wall time on a device of its own.
double seconds_on(const Backend& backend) {
    const DeviceType type = backend.capabilities().type;
    if (type == DeviceType::host || type == DeviceType::software_gpu) return cpu_seconds();
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double time_sweeps(Backend& backend, Precision precision, const SampleProblem& sample, bool blocks) {
    auto device = DeviceProblem::create(backend, precision, *sample.problem, sample.mesh.positions);
    if (!device) return std::fprintf(stderr, "%s\n", device.error().one_line().c_str()), NAN;
    auto solver = DeviceSolver::create(*device);
    if (!solver || !(*solver)->update_lengths() || !(*solver)->sweep_newton(kEps, 1, 1.6, blocks))
        return NAN; // compiles the kernels
    double best = INFINITY;
    for (int repeat = 0; repeat < 3; ++repeat) {
        const double start = seconds_on(backend);
        if (!(*solver)->sweep_newton(kEps, 1, 1.6, blocks)) return NAN;
        best = std::min(best, seconds_on(backend) - start);
    }
    return best / device->dof_count * 1e9;
}

// ---- how many floating-point operations an update is: the shared mathematics on a type that counts

namespace counting {

long operations = 0;

struct Counted {
    double v;
    Counted() = default;
    explicit Counted(double value) : v(value) {}
};
Counted count(double value) { return ++operations, Counted(value); }
Counted operator+(Counted a, Counted b) { return count(a.v + b.v); }
Counted operator-(Counted a, Counted b) { return count(a.v - b.v); }
Counted operator*(Counted a, Counted b) { return count(a.v * b.v); }
Counted operator/(Counted a, Counted b) { return count(a.v / b.v); }
Counted operator-(Counted a) { return Counted(-a.v); }
Counted& operator+=(Counted& a, Counted b) { return a = a + b; }
bool operator<(Counted a, Counted b) { return a.v < b.v; }
bool operator>(Counted a, Counted b) { return a.v > b.v; }
bool operator==(Counted a, Counted b) { return a.v == b.v; }

using real = Counted;
using rvec3 = dialect::Vec3<real>;
using rbool = bool;
using dialect::cross;
using dialect::divide;
using dialect::dot;
real sqrt(real x) { return count(std::sqrt(x.v)); }
real max(real a, real b) { return a < b ? b : a; }
real sel(bool condition, real yes, real no) { return condition ? yes : no; }
real rcbrt_seed(real x) { return real(dialect::rcbrt_seed(x.v)); }

#include "math/scaled_jacobian.glsl"
#include "math/tet_energy.glsl"

#include "math/sym3.glsl"

#include "math/corner_ball.glsl"

/// A regular vertex: 8 cells.
long operations_per_update() {
    const auto p = [](double x, double y, double z) { return rvec3(real(x), real(y), real(z)); };
    operations = 0;
    const CornerEdges e =
        corner_edges(p(1, 0, .1), p(.1, 1, 0), p(1, 1, 0), p(0, .1, 1), p(1, 0, 1), p(0, 1, 1), p(1, 1, 1.1));
    const LocalModel m = corner_model(e, real(kEps));
    const rvec3 d = newton_step(m);
    const LineEnergies l = corner_line(e, d, real(1.6), real(kEps));
    (void)search_length(l, m.energy, dot(m.gradient, d), real(1.6));
    return 8 * operations;
}

} // namespace counting

// Multiply-adds on 16 independent vectors; two operations each. GFlop/s of one thread.
__attribute__((target("avx2,fma"))) double peak_avx2() {
    typedef float Vector __attribute__((vector_size(32)));
    Vector sum[12], factor = Vector{} + 0.999f, term = Vector{} + 1e-3f;
    for (Vector& s : sum) s = Vector{} + 1.0f;
    constexpr long kRounds = 20'000'000;
    const double start = cpu_seconds();
    for (long i = 0; i < kRounds; ++i)
        for (Vector& s : sum) asm volatile("vfmadd213ps %2, %1, %0" : "+x"(s) : "x"(factor), "x"(term));
    return 2.0 * 8 * 12 * kRounds / (cpu_seconds() - start) * 1e-9;
}

__attribute__((target("avx512f"))) double peak_avx512() {
    typedef float Vector __attribute__((vector_size(64)));
    Vector sum[12], factor = Vector{} + 0.999f, term = Vector{} + 1e-3f;
    for (Vector& s : sum) s = Vector{} + 1.0f;
    constexpr long kRounds = 20'000'000;
    const double start = cpu_seconds();
    for (long i = 0; i < kRounds; ++i)
        for (Vector& s : sum) asm volatile("vfmadd213ps %2, %1, %0" : "+v"(s) : "v"(factor), "v"(term));
    return 2.0 * 16 * 12 * kRounds / (cpu_seconds() - start) * 1e-9;
}

} // namespace

int main(int argc, char** argv) {
    const int n = argc > 1 ? std::atoi(argv[1]) : 40;
    const SampleProblem sample(perturbed_cube(n, 0.2));
    const double peak = __builtin_cpu_supports("avx512f") ? peak_avx512() : peak_avx2();
    const double work = static_cast<double>(counting::operations_per_update());
    std::printf("%zu vertices; an update is %.1f kflop; multiply-add peak %.0f GFlop/s a core (f32)\n",
                sample.problem->dof_count(), work * 1e-3, peak);
    const double obvious = time_obvious(sample);
    const auto show = [&](const char* what, double ns) {
        std::printf("%-28s %9.1f ns/vertex %7.1f x %6.1f %% of peak\n", what, ns, obvious / ns,
                    100 * work / ns / peak);
        std::fflush(stdout);
    };
    show("obvious, scalar f64", obvious);
    const Parallel one(1);
    const auto scalar = create_cpu_backend(one, CpuOrder::serial),
               packs = create_cpu_backend(one, CpuOrder::parallel);
    const auto show_all = [&](const std::string& where, Backend& backend) {
        for (const bool blocks : {false, true})
            for (Precision precision : {Precision::f64, Precision::mixed, Precision::f32})
                show((where + (blocks ? ", regular " : ", any ball ") + name_of(precision)).c_str(),
                     time_sweeps(backend, precision, sample, blocks));
    };
    show_all("scalar", *scalar);
    show_all("packs", *packs);
    VulkanOptions options;
    options.cache_folder = default_cache_folder();
    const auto vulkan = create_vulkan_backend(options);
    if (!vulkan) return std::printf("vulkan: %s\n", vulkan.error().one_line().c_str()), 0;
    std::printf("%s\n", (*vulkan)->capabilities().name.c_str());
    show_all("vulkan", **vulkan);
    return 0;
}
