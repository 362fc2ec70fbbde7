#include "stages/optimize/hex_kernels.hpp"

#include "mesh/hex_reference.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

struct RandomGroup {
    std::vector<Point> positions;
    std::vector<Cell> cells;
    std::vector<float> inverse_length, inverse_stretch;
    std::vector<float> weight;
    std::vector<std::uint32_t> mask;

    RandomGroup(int count, double distortion, std::uint64_t seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> shift(-distortion, distortion), half(0.5, 2);
        for (int c = 0; c < count; ++c) {
            Cell cell;
            for (int v = 0; v < 8; ++v) {
                cell[v] = static_cast<Index>(positions.size());
                positions.push_back(Point(3.0 * c, 1, -2) +
                                    Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]) +
                                    Point(shift(random), shift(random), shift(random)));
            }
            cells.push_back(cell);
            for (int d = 0; d < 3; ++d) inverse_stretch.push_back(static_cast<float>(half(random)));
            inverse_length.push_back(1);
            weight.push_back(static_cast<float>(half(random)));
            mask.push_back(c % 3 == 1 ? static_cast<std::uint32_t>(random()) : ~0u);
        }
    }

    HexGroup group(double eps, double penalty = 0) const {
        return {positions.data(),
                cells.data(),
                inverse_length.data(),
                weight.data(),
                mask.data(),
                static_cast<int>(cells.size()),
                eps,
                0.7,
                penalty,
                0.6,
                nullptr,
                inverse_stretch.data()};
    }
};

/// E of one cell, written down anew from the formula with determinants and pow.
double reference_energy(const RandomGroup& r, const HexGroup& g, int c) {
    const auto edge = [&](int e) {
        const Cell& cell = r.cells[c];
        return (r.positions[cell[hex::kEdgeVertex[e][1]]] - r.positions[cell[hex::kEdgeVertex[e][0]]]) *
               static_cast<double>(r.inverse_stretch[3 * c + e / 4]);
    };
    double sum = 0, penalty = 0;
    for (int t = 0; t < 32; ++t) {
        if (!(r.mask[c] >> t & 1)) continue;
        const auto a = edge(hex::kTetEdge[t][0]), b = edge(hex::kTetEdge[t][1]),
                   d = edge(hex::kTetEdge[t][2]);
        const double j = glm::dot(glm::cross(a, b), d);
        const double chi = (j + std::hypot(j, g.eps)) / 2;
        sum +=
            (glm::dot(a, a) + glm::dot(b, b) + glm::dot(d, d) + g.size_weight) / (3 * std::pow(chi, 2.0 / 3));
        const double sj = j / (glm::length(a) * glm::length(b) * glm::length(d));
        if (t % 4 == 0) penalty += std::pow(std::max(0.0, g.theta - sj), 2);
    }
    return g.shape_weight * r.weight[c] * sum + g.penalty_weight * penalty;
}

} // namespace

TEST_CASE("a cube of the target size has energy 1 a tetrahedron") {
    RandomGroup r(1, 0, 1);
    r.inverse_stretch = {1, 1, 1};
    r.weight = {1};
    HexGroup g = r.group(1e-9);
    g.shape_weight = 1;
    HexValue value;
    hex_kernels().value(g, value);
    CHECK(value.energy[0] == Approx(32).epsilon(1e-12));
    CHECK(value.min_jacobian[0] == Approx(1).epsilon(1e-12));
}

TEST_CASE("energy agrees with the formula written with pow") {
    for (double distortion : {0.1, 0.5, 1.0}) {
        const RandomGroup r(kGroup, distortion, 7);
        HexGroup g = r.group(0.05, 3);
        for (double size_weight : {0.0, 3.0}) {
            g.size_weight = size_weight;
            HexValue value;
            hex_kernels().value(g, value);
            for (int c = 0; c < g.count; ++c)
                CHECK(value.energy[c] == Approx(reference_energy(r, g, c)).epsilon(1e-11));
        }
    }
}

TEST_CASE("gradient agrees with central differences of the energy") {
    for (double penalty : {0.0, 5.0}) {
        RandomGroup r(5, 0.4, 3);
        HexGroup g = r.group(0.1, penalty);
        g.size_weight = 0.3 * penalty;
        HexGradient gradient;
        hex_kernels().gradient(g, gradient);
        for (int c = 0; c < g.count; ++c)
            for (int i = 0; i < 24; ++i) {
                double& x = r.positions[r.cells[c][i / 3]][i % 3];
                const double step = 1e-6, x0 = x;
                x = x0 + step;
                const double up = reference_energy(r, g, c);
                x = x0 - step;
                const double down = reference_energy(r, g, c);
                x = x0;
                CHECK(gradient.gradient[i][c] == Approx((up - down) / (2 * step)).epsilon(2e-5).margin(2e-5));
            }
    }
}

TEST_CASE("the Hessian model is symmetric positive semidefinite and exact where only scale changes") {
    const RandomGroup r(kGroup, 0.6, 11);
    HexGroup g = r.group(0.1, 2);
    g.size_weight = 1;
    HexHessian hessian;
    hex_kernels().hessian(g, hessian);
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    const auto quadratic = [&](int c, const std::array<double, 24>& d) {
        double sum = 0;
        for (int i = 0; i < 8; ++i)
            for (int j = i; j < 8; ++j)
                for (int k = 0; k < 9; ++k)
                    sum += (i == j ? 1 : 2) * d[3 * i + k / 3] * d[3 * j + k % 3] *
                           hessian.block[9 * hessian_block(i, j) + k][c];
        return sum;
    };
    for (int c = 0; c < g.count; ++c) {
        double largest = 0;
        for (int trial = 0; trial < 50; ++trial) {
            std::array<double, 24> d;
            for (double& x : d) x = normal(random);
            const double q = quadratic(c, d);
            largest = std::max(largest, q);
            CHECK(q > -1e-5 * largest);
        }
        std::array<double, 24> shift; // a translation costs nothing
        for (int i = 0; i < 24; ++i) shift[i] = i % 3 == 1;
        CHECK(std::abs(quadratic(c, shift)) < 1e-5 * largest);
    }
}

TEST_CASE("the Hessian model equals the second difference of the energy linearised around the cell") {
    // For the unregularised energy of a cube the dropped terms are J's second derivative times dE/dJ; along a
    // motion of one vertex J is affine, so only chi'' = 0 and the model is exact there.
    RandomGroup r(1, 0.15, 2);
    r.mask = {~0u};
    HexGroup g = r.group(1e-12);
    HexHessian hessian;
    hex_kernels().hessian(g, hessian);
    for (int v = 0; v < 8; ++v)
        for (int axis = 0; axis < 3; ++axis) {
            double& x = r.positions[r.cells[0][v]][axis];
            const double step = 1e-4, x0 = x, middle = reference_energy(r, g, 0);
            x = x0 + step;
            const double up = reference_energy(r, g, 0);
            x = x0 - step;
            const double down = reference_energy(r, g, 0);
            x = x0;
            CHECK(hessian.block[9 * hessian_block(v, v) + 4 * axis][0] ==
                  Approx((up - 2 * middle + down) / (step * step)).epsilon(1e-4));
        }
}

TEST_CASE("every instruction set gives the same bits") {
    const auto kernels = available_hex_kernels();
    for (int count : {1, 7, kGroup})
        for (double penalty : {0.0, 4.0}) {
            const RandomGroup r(count, 0.7, 100 + count);
            const HexGroup g = r.group(0.01, penalty);
            HexGradient first_gradient, gradient;
            HexHessian first_hessian, hessian;
            HexMeasure first_measure, measure;
            kernels.back()->gradient(g, first_gradient);
            kernels.back()->hessian(g, first_hessian);
            kernels.back()->measure(g, first_measure);
            for (const HexKernels* k : kernels) {
                INFO(k->name);
                k->gradient(g, gradient);
                k->hessian(g, hessian);
                k->measure(g, measure);
                CHECK(std::memcmp(&gradient, &first_gradient, sizeof gradient) == 0);
                CHECK(std::memcmp(&hessian, &first_hessian, sizeof hessian) == 0);
                CHECK(std::memcmp(&measure, &first_measure, sizeof measure) == 0);
                HexValue value;
                k->value(g, value);
                CHECK(std::memcmp(&value, &first_gradient.value, sizeof value) == 0);
            }
        }
}
