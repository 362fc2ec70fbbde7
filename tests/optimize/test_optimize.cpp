#include "stages/optimize/optimize.hpp"

#include "domain/boundary_model.hpp"
#include "mesh/topology.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

HexMesh make_grid(Index n) {
    HexMesh mesh;
    const auto id = [n](Index i, Index j, Index k) { return i + (n + 1) * (j + (n + 1) * k); };
    for (Index k = 0; k <= n; ++k)
        for (Index j = 0; j <= n; ++j)
            for (Index i = 0; i <= n; ++i)
                mesh.positions.emplace_back(Point(i, j, k) / static_cast<double>(n));
    for (Index k = 0; k < n; ++k)
        for (Index j = 0; j < n; ++j)
            for (Index i = 0; i < n; ++i)
                mesh.cells.push_back({id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k),
                                      id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1),
                                      id(i, j + 1, k + 1)});
    return mesh;
}

void scramble_interior(HexMesh& mesh, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (Point& p : mesh.positions) {
        const auto inside = [](double x) { return x > 0 && x < 1; };
        if (inside(p.x) && inside(p.y) && inside(p.z)) p = {unit(random), unit(random), unit(random)};
    }
}

OptimizeStats run(HexMesh& mesh, BoundaryMode boundary, int threads = 2, int starts = 4) {
    Context context(threads);
    const Topology topology = compute_topology(mesh);
    auto surface = build_boundary_model(mesh, topology, {}, context);
    REQUIRE(surface);
    OptimizeOptions options;
    options.boundary = boundary;
    options.starts = starts;
    auto stats = optimize(mesh, topology, &*surface, options, context);
    REQUIRE(stats);
    return *stats;
}

} // namespace

TEST_CASE("a scrambled cube untangles to the lattice") {
    HexMesh mesh = make_grid(12);
    scramble_interior(mesh, 3);
    const OptimizeStats stats = run(mesh, GENERATE(BoundaryMode::fixed, BoundaryMode::slide));
    CHECK(stats.bad32_before > 1000);
    CHECK(stats.bad32_after == 0);
    CHECK(stats.min_sj_after > 0.95);
    const ValidityCounts counts = compute_validity(mesh, Parallel(1));
    CHECK(counts.is_valid());
}

TEST_CASE("the input's positions are handed over where there are better ones") {
    Context context(1);
    OptimizeOptions options;
    options.boundary = BoundaryMode::fixed;
    HexMesh mesh = make_grid(5);
    const Topology topology = compute_topology(mesh);
    std::vector<Point> replaced;
    REQUIRE(optimize(mesh, topology, nullptr, options, context, nullptr, &replaced)); // perfect as it is
    CHECK(replaced.empty());
    scramble_interior(mesh, 5);
    const std::vector<Point> before = mesh.positions;
    REQUIRE(optimize(mesh, topology, nullptr, options, context, nullptr, &replaced));
    CHECK(replaced == before);
    CHECK(mesh.positions != before);
}

TEST_CASE("a fixed boundary stays bit for bit") {
    HexMesh mesh = make_grid(6);
    scramble_interior(mesh, 5);
    const HexMesh before = mesh;
    run(mesh, BoundaryMode::fixed);
    const Topology topology = compute_topology(mesh);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (topology.on_boundary[v]) CHECK(mesh.positions[v] == before.positions[v]);
}

TEST_CASE("a sliding boundary stays on the cube, its edges and corners") {
    HexMesh mesh = make_grid(6);
    scramble_interior(mesh, 5);
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> shift(-0.05, 0.05);
    const HexMesh lattice = mesh;
    const auto on_side = [](double x) { return x == 0 || x == 1; };
    for (Point& p : mesh.positions)
        for (int a = 0; a < 3; ++a)
            if (!on_side(p[a])) p[a] += shift(random);
    run(mesh, BoundaryMode::slide);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        for (int a = 0; a < 3; ++a)
            if (on_side(lattice.positions[v][a]))
                CHECK(std::abs(mesh.positions[v][a] - lattice.positions[v][a]) < 1e-12);
}

TEST_CASE("more starts do more and end no worse") {
    HexMesh wedge = make_grid(7);
    scramble_interior(wedge, 2);
    for (Point& p : wedge.positions) p.z *= 0.2 + 0.8 * p.x * (0.3 + p.y);
    HexMesh again = wedge;
    const OptimizeStats two = run(wedge, BoundaryMode::slide, 1, 2);
    const OptimizeStats four = run(again, BoundaryMode::slide, 1, 4);
    CHECK(two.bad32_after == 0);
    CHECK(two.min_sj_after < 0.9);
    CHECK(four.newton_steps > two.newton_steps);
    CHECK(four.min_sj_after >= two.min_sj_after);
}

TEST_CASE("the best state goes on with the limits that failed attempts have narrowed renewed") {
    Context context(1);
    SampleOptions sample;
    sample.size = 4;
    sample.levels = 1;
    sample.tangled = 0.3;
    Result<HexMesh> mesh = make_sample("octree-ball", sample, context);
    REQUIRE(mesh);
    const Topology topology = compute_topology(*mesh);
    const auto surface = build_boundary_model(*mesh, topology, {}, context);
    REQUIRE(surface);
    OptimizeOptions options;
    options.max_deviation_rel = 0.01;
    options.starts = 1;
    const auto stats = optimize(*mesh, topology, &*surface, options, context);
    REQUIRE(stats);
    CHECK(stats->bad32_after == 0);
    CHECK(stats->min_sj_after > 0.87); // 0.862 where it ends with the last start
}

TEST_CASE("the result has the same bits for any number of threads") {
    HexMesh one = make_grid(10);
    scramble_interior(one, 9);
    HexMesh many = one;
    const auto mode = GENERATE(BoundaryMode::fixed, BoundaryMode::slide);
    run(one, mode, 1);
    run(many, mode, 4);
    CHECK(std::memcmp(one.positions.data(), many.positions.data(), one.positions.size() * sizeof(Point)) ==
          0);
}

TEST_CASE("a perfect mesh is left as it is") {
    HexMesh mesh = make_grid(4);
    const HexMesh before = mesh;
    run(mesh, BoundaryMode::slide);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        CHECK(glm::distance(mesh.positions[v], before.positions[v]) < 1e-12);
}

TEST_CASE("options outside their range are refused") {
    HexMesh mesh = make_grid(2);
    const Topology topology = compute_topology(mesh);
    Context context(1);
    OptimizeOptions options;
    options.boundary = BoundaryMode::slide;
    CHECK(optimize(mesh, topology, nullptr, options, context).error().code == ErrorCode::usage);
    options.boundary = BoundaryMode::fixed;
    options.max_iterations = 0;
    CHECK(optimize(mesh, topology, nullptr, options, context).error().code == ErrorCode::usage);
    options.max_iterations = 10;
    for (int starts : {0, 5}) {
        options.starts = starts;
        CHECK(optimize(mesh, topology, nullptr, options, context).error().code == ErrorCode::usage);
    }
    options.starts = 4;
    mesh.positions[13].x = std::numeric_limits<double>::quiet_NaN();
    CHECK(optimize(mesh, topology, nullptr, options, context).error().code == ErrorCode::bad_input);
}

TEST_CASE("a cancelled run says so and is never worse") {
    HexMesh mesh = make_grid(8);
    scramble_interior(mesh, 2);
    Context context(1);
    context.cancel();
    OptimizeOptions options;
    options.boundary = BoundaryMode::fixed;
    const HexMesh before = mesh;
    const auto stats = optimize(mesh, compute_topology(mesh), nullptr, options, context);
    REQUIRE_FALSE(stats);
    CHECK(stats.error().code == ErrorCode::cancelled);
    CHECK(compute_validity(mesh, Parallel(1)).concave_cells <=
          compute_validity(before, Parallel(1)).concave_cells);
}

TEST_CASE("target lengths decide the proportions of the cells") {
    // Two layers of four cells in a unit cube, 0.5 wide: the lower cells are to be 0.125 high, the upper ones
    // 0.5.
    const double thin = GENERATE(1.0, 0.25);
    HexMesh mesh = make_grid(2);
    const Topology topology = compute_topology(mesh);
    Context context(1);
    const auto surface = build_boundary_model(mesh, topology, {}, context);
    REQUIRE(surface);
    mesh.positions[13] += Point(0.05, 0.02, 0.03); // the middle vertex
    OptimizeOptions options;
    options.boundary = BoundaryMode::slide;
    options.max_min = false;
    std::vector<std::array<double, 3>> lengths(mesh.cell_count(), {1, 1, 1});
    for (std::size_t c = 0; c < 4; ++c) lengths[c][2] = thin; // the lower layer
    if (thin != 1) options.target_lengths = lengths;
    REQUIRE(optimize(mesh, topology, &*surface, options, context));
    const double height = mesh.positions[13].z;
    if (thin == 1)
        CHECK(height == Approx(0.5).margin(1e-3));
    else
        CHECK((height > 0.1 && height < 0.4));
}

TEST_CASE("target lengths of another number of cells are refused") {
    HexMesh mesh = make_grid(2);
    OptimizeOptions options;
    options.boundary = BoundaryMode::fixed;
    std::vector<std::array<double, 3>> lengths(mesh.cell_count() - GENERATE(0, 1), {1, 1, 1});
    if (lengths.size() == mesh.cell_count()) lengths[3][1] = GENERATE(0.0, -1.0, 1e9);
    options.target_lengths = lengths;
    Context context(1);
    const auto stats = optimize(mesh, compute_topology(mesh), nullptr, options, context);
    REQUIRE_FALSE(stats);
    CHECK(stats.error().code == ErrorCode::usage);
}

TEST_CASE("quick effort mends the places that need it and leaves the rest alone") {
    HexMesh mesh = make_grid(16);
    const HexMesh before = mesh;
    const auto id = [](Index i, Index j, Index k) { return i + 17 * (j + 17 * k); };
    mesh.positions[id(2, 2, 2)] += Point(0.15, 0.1, -0.05);
    const Topology topology = compute_topology(mesh);
    Context context(1);
    const auto surface = build_boundary_model(mesh, topology, {}, context);
    REQUIRE(surface);
    OptimizeOptions options;
    options.effort = Effort::quick;
    const auto stats = optimize(mesh, topology, &*surface, options, context);
    REQUIRE(stats);
    CHECK(stats->bad32_before > 0);
    CHECK(stats->bad32_after == 0);
    CHECK(stats->min_sj_after > 0.95);
    for (Index k = 10; k < 17; ++k)
        for (Index j = 10; j < 17; ++j)
            for (Index i = 10; i < 17; ++i)
                CHECK(mesh.positions[id(i, j, k)] == before.positions[id(i, j, k)]);
}
