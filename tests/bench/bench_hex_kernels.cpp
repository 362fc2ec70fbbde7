// What the hexahedron kernels cost on each instruction set that this processor runs, in CPU nanoseconds a
// cell with all 32 tetrahedra. Usage:
//   bench_hex_kernels [cells, default 4096]
#include "stages/optimize/hex_kernels.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <random>

using namespace hexopt;

namespace {

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Unit cubes with their vertices displaced at random.
struct Cells {
    std::vector<Point> positions;
    std::vector<Cell> cells;
    std::vector<float> ones;
    std::vector<std::uint32_t> mask;

    explicit Cells(std::size_t count) : cells(count), ones(3 * count, 1.0f), mask(count, ~0u) {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> shift(-0.15, 0.15);
        constexpr int kCube[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
        for (std::size_t c = 0; c < count; ++c)
            for (std::size_t v = 0; v < 8; ++v) {
                cells[c][v] = static_cast<Index>(positions.size());
                positions.emplace_back(kCube[v][0] + shift(random), kCube[v][1] + shift(random),
                                       kCube[v][2] + shift(random));
            }
    }
};

/// Least of several passes, nanoseconds a cell.
template <class Kernel, class Out>
double time_kernel(const Cells& cells, Kernel kernel, Out& out) {
    double best = 1e30;
    for (int pass = 0; pass < 30; ++pass) {
        const double start = cpu_seconds();
        for (std::size_t c = 0; c + kGroup <= cells.cells.size(); c += kGroup)
            kernel({cells.positions.data(), &cells.cells[c], cells.ones.data(), cells.ones.data(),
                    cells.mask.data(), kGroup, 0.05},
                   out);
        best = std::min(best, cpu_seconds() - start);
    }
    return 1e9 * best / static_cast<double>(cells.cells.size() / kGroup * kGroup);
}

} // namespace

int main(int argc, char** argv) {
    const Cells cells(argc > 1 ? static_cast<std::size_t>(std::atoll(argv[1])) : 4096);
    const auto value = std::make_unique<HexValue>();
    const auto gradient = std::make_unique<HexGradient>();
    const auto hessian = std::make_unique<HexHessian>();
    const auto measure = std::make_unique<HexMeasure>();
    std::printf("ns a cell       energy  gradient   hessian   measure\n");
    for (const HexKernels* kernels : available_hex_kernels())
        std::printf(
            "%-12s %9.0f %9.0f %9.0f %9.0f\n", kernels->name, time_kernel(cells, kernels->value, *value),
            time_kernel(cells, kernels->gradient, *gradient), time_kernel(cells, kernels->hessian, *hessian),
            time_kernel(cells, kernels->measure, *measure));
}
