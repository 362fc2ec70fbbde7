#include "stages/optimize/retreat.hpp"

#include "domain/boundary_model_builder.hpp"
#include "mesh/topology.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/grid.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/boundary_contacts.hpp"

#include <catch2/catch.hpp>
#include <random>

using namespace hexopt;

namespace {

/// A cube of n x n x n cells of size 1 on its own boundary.
struct Block {
    HexMesh mesh;
    Topology topology;
    BoundaryModel surface;
    int n;

    Index at(int i, int j, int k) const { return static_cast<Index>((k * (n + 1) + j) * (n + 1) + i); }

    explicit Block(int cells) : n(cells) {
        const auto side = static_cast<Index>(n);
        mesh = *make_grid({.cells = {side, side, side}, .high = Point(n)}, Parallel(1));
        topology = compute_topology(mesh);
        Context context(1);
        auto model = build_boundary_model(mesh, topology, BoundaryOptions{}, context);
        REQUIRE(model);
        surface = std::move(*model);
    }

    double farthest() const {
        double most = 0;
        for (Index v = 0; v < mesh.vertex_count(); ++v)
            most = std::max(most, surface.project(surface.associations()[v], mesh.positions[v]).distance);
        return most;
    }
};

void check_valid(const Block& block) {
    CHECK(compute_validity(block.mesh, Parallel(1)).is_valid());
    CHECK(find_boundary_contacts(block.mesh, block.topology, Parallel(1)).empty());
}

} // namespace

TEST_CASE("retreat: a mesh that is valid stays as it is") {
    Block block(3);
    const std::vector<Point> before = block.mesh.positions;
    Context context(1);
    const RetreatReport report = retreat(block.mesh, block.topology, block.surface, {}, context);
    CHECK(report.attempts == 0);
    CHECK(report.bad_before + report.touching_before == 0);
    CHECK(block.mesh.positions == before);
}

TEST_CASE("retreat: whatever fitting did, the mesh gets valid and all of it home where it can") {
    Block block(5);
    const std::vector<Point> unfitted = block.mesh.positions;
    std::mt19937 random(GENERATE(1u, 2u, 3u, 4u));
    std::uniform_real_distribution<double> shift(-2, 2);
    // Everything on the boundary slides anywhere within two cells; nothing of it is where it should be.
    for (Index v = 0; v < block.mesh.vertex_count(); ++v) {
        const Association bound = block.surface.associations()[v];
        if (bound.kind == EntityKind::interior) continue;
        const Point moved = block.mesh.positions[v] + Point(shift(random), shift(random), shift(random));
        block.mesh.positions[v] = block.surface.project(bound, moved).point;
    }
    Context context(2);
    RetreatOptions options;
    options.unfitted = unfitted;
    const RetreatReport report = retreat(block.mesh, block.topology, block.surface, options, context);
    CHECK(report.bad_before > 20);
    CHECK(report.bad_after + report.touching_after == 0);
    CHECK(block.farthest() < 1e-9);
    check_valid(block);
}

TEST_CASE("retreat: corners that cannot be met are left off, by no more than they need and are allowed") {
    Block block(4);
    const std::vector<Point> unfitted = block.mesh.positions;
    std::vector<Association> bound(block.surface.associations().begin(), block.surface.associations().end());
    std::swap(bound[block.at(0, 0, 0)], bound[block.at(1, 0, 0)]);
    BoundaryModelBuilder::bind(block.surface, bound, {}, {}, 1e-4);
    for (Index v : {block.at(0, 0, 0), block.at(1, 0, 0)})
        block.mesh.positions[v] = block.surface.project(bound[v], unfitted[v]).point;
    const std::vector<Point> fitted = block.mesh.positions;
    const double allowed = GENERATE(0.01, 10.0);
    Context context(1);
    RetreatOptions options;
    options.unfitted = unfitted;
    options.max_deviation = allowed;
    const RetreatReport report = retreat(block.mesh, block.topology, block.surface, options, context);
    REQUIRE(report.bad_before > 0);
    CHECK(block.farthest() <= allowed);
    if (allowed < 1) {
        CHECK(report.beyond_max > 0);
        CHECK(block.mesh.positions == fitted);
    } else {
        CHECK(report.bad_after == 0);
        CHECK(report.beyond_max == 0);
        CHECK(block.farthest() < 1.5);
        check_valid(block);
    }
}

TEST_CASE("retreat: the same bytes for any number of threads, and time bounds it") {
    Block block(4);
    const std::vector<Point> unfitted = block.mesh.positions;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> shift(-1.5, 1.5);
    for (Index v = 0; v < block.mesh.vertex_count(); ++v)
        block.mesh.positions[v] =
            block.surface
                .project(block.surface.associations()[v],
                         block.mesh.positions[v] + Point(shift(random), shift(random), shift(random)))
                .point;
    const std::vector<Point> fitted = block.mesh.positions;
    RetreatOptions options;
    options.unfitted = unfitted;
    std::vector<std::vector<Point>> results;
    for (int threads : {1, 3}) {
        Context context(threads);
        block.mesh.positions = fitted;
        retreat(block.mesh, block.topology, block.surface, options, context);
        results.push_back(block.mesh.positions);
    }
    CHECK(results[0] == results[1]);
    Context context(1);
    block.mesh.positions = fitted;
    options.time_limit_s = 1e-9;
    const RetreatReport report = retreat(block.mesh, block.topology, block.surface, options, context);
    CHECK(report.attempts == 0);
    CHECK(block.mesh.positions == fitted);
}

TEST_CASE("retreat: quads that touch though all cells are valid are pushed apart") {
    // A block with a slit of the width of one cell from one side to its middle, the walls of which are pushed
    // beyond one another, in the place before fitting too.
    const int n = 6;
    Block block(n);
    HexMesh& mesh = block.mesh;
    const int row = n / 2;
    const auto at = [&](int i, int j, int k) { return block.at(i, j, k); };
    std::erase_if(mesh.cells, [&](const Cell& cell) {
        const Point& low = mesh.positions[cell[0]];
        return low.x >= row && low.y == row;
    });
    block.topology = compute_topology(mesh);
    Context building(1);
    auto model = build_boundary_model(mesh, block.topology, BoundaryOptions{}, building);
    REQUIRE(model);
    block.surface = std::move(*model);
    const double over = GENERATE(0.0, 0.1, 0.3);
    for (int k = 0; k <= n; ++k)
        for (int i = row + 1; i <= n; ++i)
            for (int side = 0; side < 2; ++side)
                mesh.positions[at(i, row + side, k)].y += (side == 0 ? 1 : -1) * (0.5 + 0.5 * over);
    const std::vector<Point> unfitted = mesh.positions;
    Context context(2);
    RetreatOptions options;
    options.unfitted = unfitted;
    const RetreatReport report = retreat(mesh, block.topology, block.surface, options, context);
    CHECK(report.touching_before > 0);
    CHECK(report.bad_after + report.touching_after == 0);
    check_valid(block);
}

TEST_CASE("retreat: valid cells that are next to flat get out of it, and home again") {
    Block block(4);
    HexMesh& mesh = block.mesh;
    const std::vector<Point> unfitted = mesh.positions;
    const double short_of = GENERATE(1e-3, 1e-8, 1e-14);
    mesh.positions[block.at(1, 1, 0)] = {1.5 - short_of, 1.5 - short_of,
                                         0}; // the corner's angle is 180 degrees
    const ValidityCounts before = compute_validity(mesh, Parallel(1));
    REQUIRE(before.concave_cells == 0);
    REQUIRE(before.min_scaled_jacobian < 0.01);
    Context context(1);
    RetreatOptions options;
    options.unfitted = unfitted;
    const RetreatReport report = retreat(mesh, block.topology, block.surface, options, context);
    CHECK(report.attempts == 1);
    CHECK(report.bad_before + report.touching_before == 0);
    check_valid(block);
    CHECK(compute_validity(mesh, Parallel(1)).min_scaled_jacobian > 0.2);
    CHECK(block.farthest() < 1e-9);
}
