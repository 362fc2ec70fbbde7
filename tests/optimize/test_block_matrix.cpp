#include "stages/optimize/block_matrix.hpp"

#include "mesh/topology.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

struct Sample {
    HexMesh mesh;
    Topology topology;
    Problem problem;

    explicit Sample(const char* name)
        : mesh(make(name)), topology(compute_topology(mesh)),
          problem(mesh, topology, std::vector<std::uint8_t>(mesh.vertex_count(), 1)) {}

    static HexMesh make(const char* name) {
        Context context(1);
        return make_sample(name, {.size = 4}, context).value();
    }
};

/// Stiff along what cells share, with a dominant diagonal.
void fill(const Problem& problem, BlockMatrix& matrix) {
    matrix.set_zero();
    for (std::size_t c = 0; c < problem.cell_count(); ++c) {
        const auto dofs = problem.cell_dof()[c];
        for (Index a : dofs)
            for (Index b : dofs)
                if (a <= b)
                    matrix.add_scaled_identity(a, b, a == b ? 10.0f : -0.25f * float(1 + (a + b) % 3));
    }
}

std::vector<Point> right_hand_side(std::size_t count) {
    std::vector<Point> b(count);
    for (std::size_t i = 0; i < count; ++i)
        b[i] = Point(std::sin(1.0 * i), std::cos(2.0 * i), std::sin(3.0 * i));
    return b;
}

} // namespace

TEST_CASE("columns in 16 and in 32 bits make the same matrix") {
    for (const char* name : {"grid", "octree-sphere"}) {
        CAPTURE(name);
        const Sample sample(name);
        const Parallel parallel(1);
        std::vector<std::vector<Point>> x;
        for (Index widest : {Index{0xFFFF}, Index{0}}) {
            BlockMatrix matrix(sample.problem, widest);
            fill(sample.problem, matrix);
            const auto b = right_hand_side(matrix.rows());
            x.emplace_back(matrix.rows());
            CHECK(solve_cg(matrix, b, {}, x.back(), 1e-10, 100, parallel).iterations > 3);
        }
        CHECK(std::memcmp(x[0].data(), x[1].data(), x[0].size() * sizeof(Point)) == 0);
    }
}

TEST_CASE("conjugate gradients keep to the freedoms of held dofs, the others solve their rows") {
    const Sample sample("grid");
    BlockMatrix matrix(sample.problem);
    fill(sample.problem, matrix);
    const auto b = right_hand_side(matrix.rows());
    const Point direction = glm::normalize(Point(1, 2, 3));
    const std::vector<Index> held = {0, 7, 8, static_cast<Index>(matrix.rows() - 1)};
    const std::vector<Freedom> freedom = {{Freedom::none, Point(0)},
                                          {Freedom::plane, direction},
                                          {Freedom::line, direction},
                                          {Freedom::free, Point(0)}};
    std::vector<Point> x(matrix.rows()), whole(matrix.rows());
    solve_cg(matrix, b, {held, freedom}, x, 1e-12, 300, Parallel(2));
    CHECK(glm::length(x[0]) == 0);
    CHECK(std::abs(glm::dot(x[7], direction)) < 1e-5 * glm::length(x[7]));
    CHECK(glm::length(x[8] - glm::dot(x[8], direction) * direction) < 1e-5 * glm::length(x[8]));

    // What is free all over is as if it were not named.
    solve_cg(matrix, b, {}, whole, 1e-12, 300, Parallel(1));
    const std::vector<Freedom> all_free(held.size());
    solve_cg(matrix, b, {held, all_free}, x, 1e-12, 300, Parallel(1));
    CHECK(std::memcmp(x.data(), whole.data(), x.size() * sizeof(Point)) == 0);

    // Rows of dofs that are free hold.
    solve_cg(matrix, b, {held, freedom}, x, 1e-12, 300, Parallel(1));
    using Float4 = BlockMatrix::Float4;
    std::vector<Float4> in(x.size()), out(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) in[i] = Float4{float(x[i].x), float(x[i].y), float(x[i].z), 0};
    matrix.multiply(in, out, Parallel(1));
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (i == 0 || i == 7 || i == 8) continue;
        CHECK(glm::length(Point(out[i][0], out[i][1], out[i][2]) - b[i]) < 1e-4);
    }
}
