#include "samples/grid.hpp"

#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"

#include <glm/common.hpp>

#include <cmath>
#include <numbers>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 4096;

/// Coordinates of count + 1 lines whose distances grow by a constant factor.
std::vector<double> graded_lines(Index count, double low, double high, double grading) {
    std::vector<double> lines(count + 1);
    const double ratio = count > 1 ? std::pow(grading, 1.0 / (count - 1)) : 1;
    const bool is_uniform = std::abs(ratio - 1) < 1e-12;
    const double total = is_uniform ? count : std::pow(ratio, count) - 1;
    for (Index i = 0; i <= count; ++i)
        lines[i] = low + (high - low) * (is_uniform ? i : std::pow(ratio, i) - 1) / total;
    return lines;
}

struct Box {
    Point low, high;
};

Box bounding_box(const HexMesh& mesh, const Parallel& parallel) {
    const Box none{Point(HUGE_VAL), Point(-HUGE_VAL)};
    return parallel.reduce(
        mesh.vertex_count(), kChunk, none,
        [&](std::size_t begin, std::size_t end) {
            Box box = none;
            for (std::size_t v = begin; v < end; ++v) {
                box.low = glm::min(box.low, mesh.positions[v]);
                box.high = glm::max(box.high, mesh.positions[v]);
            }
            return box;
        },
        [](const Box& a, const Box& b) {
            return Box{glm::min(a.low, b.low), glm::max(a.high, b.high)};
        });
}

} // namespace

Result<HexMesh> make_grid(const GridOptions& options, const Parallel& parallel) {
    const auto [nx, ny, nz] = options.cells;
    double vertices = 1;
    for (int axis = 0; axis < 3; ++axis) {
        vertices *= options.cells[axis] + 1.0;
        if (options.cells[axis] == 0 || !(options.grading[axis] > 0))
            return make_error(ErrorCode::usage, "sample", "",
                              "a grid needs at least one cell along each axis and a positive grading");
    }
    if (vertices >= kNoIndex)
        return make_error(ErrorCode::usage, "sample", "", "the grid has more vertices than fit in 32 bits");

    std::array<std::vector<double>, 3> lines;
    for (int axis = 0; axis < 3; ++axis)
        lines[axis] =
            graded_lines(options.cells[axis], options.low[axis], options.high[axis], options.grading[axis]);
    HexMesh mesh;
    mesh.positions.resize(static_cast<std::size_t>(vertices));
    mesh.cells.resize(std::size_t{nx} * ny * nz);
    mesh.level.assign(mesh.cell_count(), 0);
    parallel.for_each(mesh.vertex_count(), kChunk, [&, nx = nx, ny = ny](std::size_t v) {
        const std::size_t row = v / (nx + 1);
        mesh.positions[v] = Point(lines[0][v % (nx + 1)], lines[1][row % (ny + 1)], lines[2][row / (ny + 1)]);
    });
    parallel.for_each(mesh.cell_count(), kChunk, [&, nx = nx, ny = ny](std::size_t c) {
        const std::size_t i = c % nx, j = c / nx % ny, k = c / nx / ny;
        for (int corner = 0; corner < 8; ++corner)
            mesh.cells[c][corner] = static_cast<Index>(
                ((k + hex::kVertexZ[corner]) * (ny + 1) + j + hex::kVertexY[corner]) * (nx + 1) + i +
                hex::kVertexX[corner]);
    });
    return mesh;
}

void warp(HexMesh& mesh, double amplitude, const Parallel& parallel) {
    const Box box = bounding_box(mesh, parallel);
    const Point size = box.high - box.low;
    parallel.for_each(mesh.vertex_count(), kChunk, [&](std::size_t v) {
        const Point t = 2 * std::numbers::pi * (mesh.positions[v] - box.low) / size;
        mesh.positions[v] += amplitude * size *
                             Point(std::sin(t.y) * std::cos(t.z), std::sin(t.z + 0.5) * std::cos(t.x),
                                   std::sin(t.x + 1) * std::cos(t.y));
    });
    apply_hanging(mesh, parallel);
}

void bend_to_ball(HexMesh& mesh, double strength, const Parallel& parallel) {
    const Box box = bounding_box(mesh, parallel);
    const Point centre = 0.5 * (box.low + box.high), half = 0.5 * (box.high - box.low);
    parallel.for_each(mesh.vertex_count(), kChunk, [&](std::size_t v) {
        const Point p = (mesh.positions[v] - centre) / half, q = p * p;
        const Point shrink(std::sqrt(1 - q.y / 2 - q.z / 2 + q.y * q.z / 3),
                           std::sqrt(1 - q.z / 2 - q.x / 2 + q.z * q.x / 3),
                           std::sqrt(1 - q.x / 2 - q.y / 2 + q.x * q.y / 3));
        mesh.positions[v] = centre + half * p * (1.0 + strength * (shrink - 1.0));
    });
    apply_hanging(mesh, parallel);
}

} // namespace hexopt
