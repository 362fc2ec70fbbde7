#include "stages/optimize/local_energy.hpp"

#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/laplacian.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

HexMesh sample(const char* name, Index size, int levels, double tangled, std::uint64_t seed) {
    Context context(1, seed);
    return *make_sample(name, {size, levels, tangled, false, PerturbPattern::everywhere}, context);
}

/// The energy of one tetrahedron, written with matrices as the texts have it.
double reference_density(Energy kind, double eps, const Eigen::Matrix3d& jacobian) {
    const Eigen::Matrix3d g = jacobian.transpose() * jacobian;
    const double j = jacobian.determinant(), i1 = g.trace();
    const double i2 = 0.5 * (i1 * i1 - (g * g).trace());
    switch (kind) {
    case Energy::structural:
        return j > 0 ? i1 / std::pow(g.determinant(), 1.5) : INFINITY;
    case Energy::shape:
        return j > 0 ? i1 / (3 * std::pow(g.determinant(), 1.0 / 3)) : INFINITY;
    case Energy::hyperelastic:
        return i1 + i2 - 6 * j + (j - 1) * (j - 1);
    default:
        return i1 / (3 * std::pow((j + std::sqrt(j * j + eps * eps)) / 2, 2.0 / 3));
    }
}

/// Summed over every tetrahedron of the mesh, whatever depends on what.
double reference_energy(const HexMesh& mesh, const CellTargets& targets, const LocalEnergy& energy,
                        std::uint32_t tets) {
    double sum = 0;
    for (std::size_t c = 0; c < mesh.cell_count(); ++c)
        for (int t = 0; t < 32; ++t) {
            if (!(tets >> t & 1)) continue;
            Eigen::Matrix3d m;
            for (int i = 0; i < 3; ++i) {
                const auto& e = hex::kEdgeVertex[hex::kTetEdge[t][i]];
                const Point edge =
                    (mesh.positions[mesh.cells[c][e[1]]] - mesh.positions[mesh.cells[c][e[0]]]) /
                    targets.length[c];
                m.col(i) = Eigen::Vector3d(edge.x, edge.y, edge.z);
            }
            sum += targets.weight[c] * reference_density(energy.kind, energy.eps, m);
        }
    return sum;
}

struct Setup {
    HexMesh mesh;
    Topology topology;
    Stencils stencils;
    CellTargets targets;
    explicit Setup(HexMesh m)
        : mesh(std::move(m)), topology(compute_topology(mesh)), stencils(compute_stencils(mesh, topology)),
          targets(measure_targets(mesh, topology, mesh.positions, Parallel(1))) {}

    Ball ball(Index v, std::uint32_t tets) const {
        Ball b;
        b.gather(mesh, mesh.positions, stencils, targets, v, tets);
        return b;
    }
    std::vector<Index> free_vertices() const {
        std::vector<Index> free;
        for (Index v = 0; v < mesh.vertex_count(); ++v)
            if (!topology.on_boundary[v] &&
                (topology.hanging_row.empty() || topology.hanging_row[v] == kNoIndex))
                free.push_back(v);
        return free;
    }
};

const Energy kKinds[] = {Energy::structural, Energy::shape, Energy::hyperelastic, Energy::regularised};

} // namespace

TEST_CASE("a cube of the target size has the energies of the ideal") {
    const Setup s(sample("grid", 2, 0, 0, 1));
    for (std::uint32_t tets : {0x11111111u, 0xeeeeeeeeu, ~0u}) {
        const Ball ball = s.ball(13, tets);
        const double count = static_cast<double>(ball.tets().size());
        CHECK(count == (tets == ~0u ? 128 : tets == 0x11111111u ? 32 : 96));
        CHECK(evaluate_energy(ball.tets(), {Energy::structural, 0}, Point(0)) == Approx(3 * count));
        CHECK(evaluate_energy(ball.tets(), {Energy::shape, 0}, Point(0)) == Approx(count));
        CHECK(evaluate_energy(ball.tets(), {Energy::hyperelastic, 0}, Point(0)) == Approx(0).margin(1e-9));
        CHECK(evaluate_energy(ball.tets(), {Energy::regularised, 1e-6}, Point(0)) == Approx(count));
        for (Energy kind : kKinds)
            CHECK(glm::length(evaluate_gradient(ball.tets(), {kind, 1e-6}, Point(0))) < 1e-7 * count);
        CHECK(ball.quality(Point(0)) == Approx(1));
        CHECK_FALSE(ball.is_tangled());
    }
}

TEST_CASE("a ball's energy changes as the whole mesh's when the vertex moves and what hangs follows") {
    const bool hanging = GENERATE(false, true);
    Setup s(hanging ? sample("octree-corner", 3, 2, 0.2, 5) : sample("grid-warped", 3, 0, 0.2, 5));
    REQUIRE(s.mesh.hanging.empty() == !hanging);
    std::mt19937_64 random(2);
    const auto free = s.free_vertices();
    for (int trial = 0; trial < 12; ++trial) {
        const Index v = free[random() % free.size()];
        const std::uint32_t tets = trial % 3 == 0 ? ~0u : trial % 3 == 1 ? 0x11111111u : 0xeeeeeeeeu;
        const Ball ball = s.ball(v, tets);
        std::uniform_real_distribution<double> shift(-0.3 * ball.mean_length(), 0.3 * ball.mean_length());
        const Point d(shift(random), shift(random), shift(random));
        HexMesh moved = s.mesh;
        moved.positions[v] += d;
        apply_hanging(moved, Parallel(1));
        for (Energy kind : {Energy::hyperelastic, Energy::regularised}) {
            const LocalEnergy energy{kind, 0.1};
            const double change = reference_energy(moved, s.targets, energy, tets) -
                                  reference_energy(s.mesh, s.targets, energy, tets);
            CHECK(evaluate_energy(ball.tets(), energy, d) - evaluate_energy(ball.tets(), energy, Point(0)) ==
                  Approx(change).epsilon(1e-7).margin(1e-7));
        }
    }
}

TEST_CASE("energies with a barrier agree with the formulas and are infinite outside the kernel") {
    const Setup s(sample("octree-corner", 3, 2, 0, 5));
    for (Index v : s.free_vertices()) {
        const Ball ball = s.ball(v, ~0u);
        REQUIRE_FALSE(ball.is_tangled());
        const Point d(0.05 * ball.mean_length(), -0.04 * ball.mean_length(), 0.03 * ball.mean_length());
        HexMesh moved = s.mesh;
        moved.positions[v] += d;
        apply_hanging(moved, Parallel(1));
        for (Energy kind : {Energy::structural, Energy::shape}) {
            const double change = reference_energy(moved, s.targets, {kind, 0}, ~0u) -
                                  reference_energy(s.mesh, s.targets, {kind, 0}, ~0u);
            CHECK(evaluate_energy(ball.tets(), {kind, 0}, d) -
                      evaluate_energy(ball.tets(), {kind, 0}, Point(0)) ==
                  Approx(change).epsilon(1e-7).margin(1e-7));
            CHECK(std::isinf(evaluate_energy(ball.tets(), {kind, 0}, Point(9 * ball.mean_length()))));
        }
    }
}

TEST_CASE("analytic gradients agree with central differences, and (4.24) with both to its order") {
    const Setup tangled(sample("octree-corner", 3, 2, 0.3, 7)), valid(sample("octree-warped", 3, 1, 0, 7));
    for (Energy kind : kKinds) {
        const Setup& s = has_barrier(kind) ? valid : tangled;
        const LocalEnergy energy{kind, 0.2};
        for (Index v : s.free_vertices()) {
            const Ball ball = s.ball(v, ~0u);
            if (has_barrier(kind) && ball.is_tangled()) continue;
            const double h = 1e-6 * ball.mean_length();
            const Point gradient = evaluate_gradient(ball.tets(), energy, Point(0));
            const double scale = evaluate_energy(ball.tets(), energy, Point(0)) / ball.mean_length();
            Point central;
            for (int i = 0; i < 3; ++i) {
                Point d(0);
                d[i] = h;
                central[i] =
                    (evaluate_energy(ball.tets(), energy, d) - evaluate_energy(ball.tets(), energy, -d)) /
                    (2 * h);
            }
            CHECK(glm::distance(gradient, central) < 1e-6 * scale + 1e-6 * glm::length(gradient));
            const Point forward = difference_gradient(ball.tets(), energy, 1e-4 * ball.mean_length());
            CHECK(glm::distance(gradient, forward) < 0.02 * scale + 0.02 * glm::length(gradient));
        }
    }
}

TEST_CASE("the 1-D minimisation finds the least energy of a dense sample of the line") {
    const Setup tangled(sample("grid", 4, 0, 0.3, 3)), valid(sample("octree-warped", 3, 1, 0, 7));
    for (Energy kind : kKinds) {
        const Setup& s = has_barrier(kind) ? valid : tangled;
        const LocalEnergy energy{kind, 0.2};
        int moved = 0;
        for (Index v : s.free_vertices()) {
            const Ball ball = s.ball(v, 0x11111111u);
            if (has_barrier(kind) && ball.is_tangled()) continue;
            const Point slope = evaluate_gradient(ball.tets(), energy, Point(0));
            const Point direction = -slope / glm::length(slope);
            const double limit = ball.mean_length();
            const double t = minimise_on_line(ball.tets(), energy, direction, limit);
            const double start = evaluate_energy(ball.tets(), energy, Point(0));
            const double found = evaluate_energy(ball.tets(), energy, t * direction);
            CHECK(found <= start);
            CHECK((t >= 0 && t <= limit));
            double least = start;
            for (int i = 1; i <= 1000; ++i) {
                const double value = evaluate_energy(ball.tets(), energy, direction * (limit * i / 1000));
                if (kind == Energy::regularised && value > least) break; // its first valley
                least = std::min(least, value);
            }
            CHECK(found <= least + 2e-3 * (start - least) + 1e-9 * start);
            moved += t > 0;
        }
        CHECK(moved > 5);
    }
}

TEST_CASE("against the direction of descent nothing is done") {
    const Setup s(sample("grid-warped", 3, 0, 0, 3));
    const Ball ball = s.ball(s.free_vertices()[0], ~0u);
    const Point slope = evaluate_gradient(ball.tets(), {Energy::shape, 0}, Point(0));
    CHECK(minimise_on_line(ball.tets(), {Energy::shape, 0}, slope, 1) == 0);
}

TEST_CASE("a ball's half-spaces hold exactly where its tetrahedra are positive") {
    const Setup s(sample("octree-corner", 3, 2, 0.4, 11));
    std::mt19937_64 random(3);
    for (Index v : s.free_vertices()) {
        const Ball ball = s.ball(v, ~0u);
        std::uniform_real_distribution<double> shift(-ball.mean_length(), ball.mean_length());
        for (int trial = 0; trial < 5; ++trial) {
            const Point d(shift(random), shift(random), shift(random));
            CHECK((depth_at(ball.half_spaces(), d) > 0) == (ball.quality(d) > 0));
        }
        CHECK((depth_at(ball.half_spaces(), Point(0)) > 0) == !ball.is_tangled());
    }
}

TEST_CASE("Laplacian smoothing: the neighbours' mean, nearer to those along shorter targets") {
    Setup s(sample("grid", 2, 0, 0, 1));
    CHECK(glm::distance(laplacian_point(s.mesh, s.topology, s.mesh.positions, s.targets, 13), Point(0.5)) <
          1e-15);
    // Cells with x < 1/2 have half the target: weight 2 against 1 along x; along y and z every edge has two
    // cells of either kind, target 3/4 of the large ones', the same on both sides.
    for (Index c = 0; c < 8; ++c) s.targets.length[c] = c % 2 == 0 ? 0.25 : 0.5;
    const Point p = laplacian_point(s.mesh, s.topology, s.mesh.positions, s.targets, 13);
    const double sum = 1 / 0.25 + 1 / 0.5 + 4 / 0.375;
    CHECK(p.x == Approx((0 / 0.25 + 1 / 0.5 + 4 * 0.5 / 0.375) / sum));
    CHECK(p.y == Approx(0.5));
    CHECK(p.z == Approx(0.5));
}
