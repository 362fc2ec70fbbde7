#include "mesh/stencil.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "mesh_oracles.hpp"

#include <map>

using namespace hexopt;
using namespace hexopt::test;

namespace {

/// Weights of every cell's corners for every vertex, from the definition.
std::vector<std::map<Index, CornerWeights>> balls_by_definition(const HexMesh& mesh) {
    const auto row_of = compute_hanging_row(mesh.hanging, mesh.vertex_count());
    std::vector<std::map<Index, CornerWeights>> balls(mesh.vertex_count());
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (int k = 0; k < 8; ++k) {
            const Index v = mesh.cells[c][k];
            const Index row = row_of.empty() ? kNoIndex : row_of[v];
            if (row == kNoIndex) {
                balls[v][c][k] = 1;
                continue;
            }
            for (std::size_t i = mesh.hanging.offset[row]; i < mesh.hanging.offset[row + 1]; ++i)
                balls[mesh.hanging.master[i]][c][k] = mesh.hanging.weight[i];
        }
    return balls;
}

std::array<double, 32> determinants(const HexMesh& mesh, const std::vector<Point>& x, Index c) {
    std::array<double, 32> det;
    const auto edge = [&](int e) {
        return x[mesh.cells[c][hex::kEdgeVertex[e][1]]] - x[mesh.cells[c][hex::kEdgeVertex[e][0]]];
    };
    for (int t = 0; t < 32; ++t)
        det[t] = glm::dot(edge(hex::kTetEdge[t][0]),
                          glm::cross(edge(hex::kTetEdge[t][1]), edge(hex::kTetEdge[t][2])));
    return det;
}

} // namespace

TEST_CASE("stencils list exactly the cells and weights of the definition") {
    std::vector<std::string> names = kOctrees;
    names.push_back("grid-warped");
    for (const std::string& name : names) {
        CAPTURE(name);
        const HexMesh mesh = sample(name, {.size = 5});
        const Topology topology = compute_topology(mesh);
        const Stencils stencils = compute_stencils(mesh, topology);
        const auto expected = balls_by_definition(mesh);
        REQUIRE(stencils.vertex_count() == mesh.vertex_count());
        for (Index v = 0; v < mesh.vertex_count(); ++v) {
            const auto ball = stencils.ball(v);
            REQUIRE(ball.size() == expected[v].size());
            auto at = expected[v].begin();
            for (std::size_t i = 0; i < ball.size(); ++i, ++at) {
                REQUIRE(ball[i].cell == at->first);
                REQUIRE(stencils.weights(ball[i]) == at->second);
                if (ball[i].pattern < 8) REQUIRE(mesh.cells[ball[i].cell][ball[i].pattern] == v);
            }
        }
    }
}

TEST_CASE("a conforming mesh's stencils are its vertex cells") {
    const HexMesh mesh = sample("grid");
    const Topology topology = compute_topology(mesh);
    const Stencils stencils = compute_stencils(mesh, topology);
    CHECK(stencils.patterns.size() == 8);
    CHECK(stencils.own.item.empty());
    CHECK(stencils.ball(0).corners() == topology.vertex_cell[0].data());
}

TEST_CASE("moving a master moves its ball as the stencil says and keeps every determinant affine") {
    for (const std::string& name : kOctrees) {
        CAPTURE(name);
        const HexMesh mesh = sample(name, {.size = 4, .scrambled = true});
        const Topology topology = compute_topology(mesh);
        const Stencils stencils = compute_stencils(mesh, topology);
        Random random(11);
        for (int trial = 0; trial < 60; ++trial) {
            const Index v = static_cast<Index>(random.below(mesh.vertex_count()));
            if (stencils.ball(v).empty()) continue;
            const Point d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
            const auto moved = [&](double factor) {
                std::vector<Point> x = mesh.positions;
                x[v] += factor * d;
                apply_hanging(mesh.hanging, x, Parallel(1));
                return x;
            };
            const std::vector<Point> once = moved(1), twice = moved(2);
            std::vector<std::uint8_t> in_ball(mesh.cell_count(), 0);
            for (BallEntry at : stencils.ball(v)) {
                in_ball[at.cell] = 1;
                for (int k = 0; k < 8; ++k) {
                    const Index corner = mesh.cells[at.cell][k];
                    const Point expected = mesh.positions[corner] + stencils.weights(at)[k] * d;
                    REQUIRE(glm::distance(once[corner], expected) < 1e-14);
                }
                const auto a = determinants(mesh, mesh.positions, at.cell),
                           b = determinants(mesh, once, at.cell), c = determinants(mesh, twice, at.cell);
                for (int t = 0; t < 32; ++t)
                    REQUIRE(std::abs(a[t] - 2 * b[t] + c[t]) < 1e-13 * (1 + std::abs(c[t])));
            }
            for (Index c = 0; c < mesh.cell_count(); ++c)
                if (!in_ball[c])
                    for (Index k : mesh.cells[c]) REQUIRE(once[k] == mesh.positions[k]);
        }
    }
}
