#include "stages/optimize/thesis_sweeps.hpp"

#include "stages/optimize/hex_kernels.hpp"
#include "stages/optimize/laplacian.hpp"

#include <algorithm>
#include <atomic>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

constexpr std::size_t kVertexChunk = 32;

/// How far from the kernel's boundary a point counts as strictly inside, relative to the ball's size.
constexpr double kInside = 1e-9;

Csr<Index> find_followers(const HexMesh& mesh) {
    Csr<Index> rows;
    const Hanging& hanging = mesh.hanging;
    if (hanging.empty()) return rows;
    rows.offset.assign(mesh.vertex_count() + 1, 0);
    for (Index master : hanging.master) ++rows.offset[master + 1];
    std::partial_sum(rows.offset.begin(), rows.offset.end(), rows.offset.begin());
    rows.item.resize(hanging.master.size());
    std::vector<std::size_t> next(rows.offset.begin(), rows.offset.end() - 1);
    for (std::size_t row = 0; row < hanging.count(); ++row)
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
            rows.item[next[hanging.master[k]]++] = static_cast<Index>(row);
    return rows;
}

/// Where Algorithm 1 puts the vertex; none: it is skipped.
std::optional<Point> find_kernel_point(const Ball& ball, UntangleTarget target, std::uint64_t seed) {
    const auto planes = ball.half_spaces();
    const Point extent = ball.box().high - ball.box().low;
    const double inside = kInside * std::max({extent.x, extent.y, extent.z});
    if (target == UntangleTarget::deepest_point) {
        const DeepestPoint deepest = find_deepest_point(planes, ball.box(), seed);
        return deepest.depth > inside ? std::optional(deepest.point) : std::nullopt;
    }
    for (bool extended : {false, true}) {
        if (extended && target == UntangleTarget::axis) break;
        const auto point = average_extremes(planes, ball.box(), extended);
        if (!point) return std::nullopt;
        if (depth_at(planes, *point) > inside) return point;
    }
    return std::nullopt;
}

} // namespace

LocalSweeps::LocalSweeps(const HexMesh& mesh, const Topology& topology, std::span<const std::uint8_t> movable,
                         std::vector<Point>& positions, Budget& budget)
    : mesh_(mesh), topology_(topology), positions_(positions), budget_(budget),
      stencils_(compute_stencils(mesh, topology)),
      colouring_(compute_colouring(mesh, topology, stencils_, movable)), followers_(find_followers(mesh)),
      targets_(measure_targets(mesh, topology, positions, budget.parallel())) {}

template <class Visit>
void LocalSweeps::for_each_vertex(const Visit& visit) {
    for (std::size_t colour = 0; colour < colouring_.count(); ++colour) {
        const auto vertices = colouring_.vertices[colour];
        budget_.parallel().for_chunks(vertices.size(), kVertexChunk, [&](std::size_t begin, std::size_t end) {
            Ball ball;
            for (std::size_t i = begin; i < end; ++i) visit(vertices[i], ball);
        });
    }
    budget_.spend_iteration();
}

bool LocalSweeps::touches(Index vertex, std::span<const std::uint8_t> cells) const {
    const auto ball = stencils_.ball(vertex);
    return std::any_of(ball.begin(), ball.end(), [&](BallEntry entry) { return cells[entry.cell] != 0; });
}

void LocalSweeps::move(Index vertex, const Point& d) {
    positions_[vertex] += d;
    if (followers_.rows() == 0) return;
    for (Index row : followers_[vertex]) {
        const Hanging& hanging = mesh_.hanging;
        Point sum(0);
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
            sum += hanging.weight[k] * positions_[hanging.master[k]];
        positions_[hanging.vertex[row]] = sum;
    }
}

template <class Take>
void LocalSweeps::measure(std::uint32_t tets, const Take& take) const {
    budget_.parallel().for_chunks(mesh_.cell_count(), 4096, [&](std::size_t begin, std::size_t end) {
        const std::vector<float> ones(3 * kGroup, 1.0f);
        const std::vector<std::uint32_t> mask(kGroup, tets);
        HexMeasure lanes;
        for (std::size_t c = begin; c < end; c += kGroup) {
            const int count = static_cast<int>(std::min<std::size_t>(kGroup, end - c));
            hex_kernels().measure(
                {positions_.data(), &mesh_.cells[c], ones.data(), ones.data(), mask.data(), count, 1}, lanes);
            for (int i = 0; i < count; ++i) take(c + i, lanes.min_det32[i], lanes.min_sj[i]);
        }
    });
}

std::vector<std::uint8_t> LocalSweeps::find_concave(std::uint32_t tets) const {
    std::vector<std::uint8_t> concave(mesh_.cell_count(), 0);
    measure(tets, [&](std::size_t c, double determinant, double) { concave[c] = !(determinant > 0); });
    return concave;
}

double LocalSweeps::find_least_jacobian(std::uint32_t tets) const {
    std::vector<double> jacobian(mesh_.cell_count());
    measure(tets, [&](std::size_t c, double determinant, double) {
        const double length = targets_.length[c];
        jacobian[c] = determinant / (length * length * length);
    });
    return jacobian.empty() ? 1 : *std::min_element(jacobian.begin(), jacobian.end());
}

double LocalSweeps::find_min_sj() const {
    std::vector<double> sj(mesh_.cell_count());
    measure(~0u, [&](std::size_t c, double, double value) { sj[c] = value; });
    return sj.empty() ? 1 : *std::min_element(sj.begin(), sj.end());
}

std::size_t LocalSweeps::count_concave(std::uint32_t tets) const {
    const auto concave = find_concave(tets);
    return static_cast<std::size_t>(std::count(concave.begin(), concave.end(), 1));
}

std::size_t LocalSweeps::untangle(std::uint32_t tets, UntangleTarget target) {
    const auto concave = find_concave(tets);
    std::atomic<std::size_t> moved = 0;
    for_each_vertex([&](Index v, Ball& ball) {
        if (!touches(v, concave)) return;
        ball.gather(mesh_, positions_, stencils_, targets_, v, tets);
        if (!ball.is_tangled()) return;
        if (const auto d = find_kernel_point(ball, target, budget_.context().seed() ^ v)) {
            move(v, *d);
            ++moved;
        }
    });
    return moved;
}

void LocalSweeps::optimise(std::uint32_t tets, const LocalEnergy& energy, GradientKind gradient) {
    for_each_vertex([&](Index v, Ball& ball) {
        ball.gather(mesh_, positions_, stencils_, targets_, v, tets);
        if (has_barrier(energy.kind) && ball.is_tangled()) return;
        const Point slope = gradient == GradientKind::analytic
                                ? evaluate_gradient(ball.tets(), energy, Point(0))
                                : difference_gradient(ball.tets(), energy, 1e-4 * ball.mean_length());
        const double length = glm::length(slope);
        if (!(length > 0 && std::isfinite(length))) return;
        const Point direction = -slope / length;
        const double t = minimise_on_line(ball.tets(), energy, direction, ball.mean_length());
        if (t > 0) move(v, t * direction);
    });
}

double LocalSweeps::step_jacobi(std::uint32_t tets, const LocalEnergy& energy, double relaxation) {
    std::vector<Point> step(mesh_.vertex_count(), Point(0));
    std::vector<double> local(mesh_.vertex_count(), 0);
    for_each_vertex([&](Index v, Ball& ball) {
        ball.gather(mesh_, positions_, stencils_, targets_, v, tets);
        local[v] = evaluate_energy(ball.tets(), energy, Point(0));
        const Point slope = evaluate_gradient(ball.tets(), energy, Point(0));
        const double length = glm::length(slope);
        if (!(length > 0 && std::isfinite(length))) return;
        const Point direction = -slope / length;
        step[v] =
            relaxation * minimise_on_line(ball.tets(), energy, direction, ball.mean_length()) * direction;
    });
    for (Index v = 0; v < step.size(); ++v)
        if (step[v] != Point(0)) move(v, step[v]);
    return std::accumulate(local.begin(), local.end(), 0.0);
}

void LocalSweeps::smooth(std::span<const std::uint8_t> cells, bool smart) {
    for_each_vertex([&](Index v, Ball& ball) {
        if (!touches(v, cells)) return;
        const Point d = laplacian_point(mesh_, topology_, positions_, targets_, v) - positions_[v];
        if (smart) {
            ball.gather(mesh_, positions_, stencils_, targets_, v, ~0u);
            if (ball.quality(d) < ball.quality(Point(0))) return;
        }
        move(v, d);
    });
}

} // namespace hexopt
