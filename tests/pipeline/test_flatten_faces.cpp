#include "pipeline/flatten_faces.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "pipeline/surface_quads.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;
using Catch::Detail::Approx;

namespace {

/// A sample whose inner vertices are moved at random; hanging ones go along.
HexMesh shaken(const char* name, std::uint64_t seed, double share) {
    Context context(1);
    SampleOptions options;
    options.size = 4;
    auto mesh = make_sample(name, options, context);
    REQUIRE(mesh);
    const Topology topology = compute_topology(*mesh);
    Random random(seed);
    for (Index v = 0; v < mesh->vertex_count(); ++v) {
        if (topology.on_boundary[v]) continue;
        double shortest = 1e300;
        for (const CellCorner& corner : topology.vertex_cell[v])
            for (double length : edge_lengths(cell_points(*mesh, corner.cell)))
                shortest = std::min(shortest, length);
        for (int k = 0; k < 3; ++k) mesh->positions[v][k] += share * shortest * (2 * random.uniform() - 1);
    }
    apply_hanging(*mesh, context.parallel());
    return std::move(*mesh);
}

/// No cell became worse than it was and than the options allow.
void check_cells_kept(std::span<const CellValidity> before, std::span<const CellValidity> after,
                      const FlattenOptions& options) {
    std::size_t worse = 0;
    for (std::size_t c = 0; c < after.size(); ++c)
        worse += is_worse(after[c], before[c]) &&
                 !(after[c].is_usable() && after[c].scaled_jacobian >= options.last_min_sj);
    CHECK(worse == 0);
}

} // namespace

TEST_CASE("warped faces are flattened, and nothing else becomes worse") {
    std::size_t before = 0, after = 0, moved = 0;
    for (const char* name : {"grid", "octree-sphere", "octree-halved"})
        for (std::uint64_t seed = 0; seed < 10; ++seed) {
            HexMesh mesh = shaken(name, seed, 0.65);
            const Topology topology = compute_topology(mesh);
            const std::vector<Point> start = mesh.positions;
            Context context(1);
            const auto old_cells = compute_cell_validities(mesh, context.parallel());
            const FlattenOptions options;
            const auto report = flatten_faces(mesh, topology, options, context);
            REQUIRE(report);
            before += report->warped_before;
            after += report->warped_after;
            moved += report->moved;
            CHECK(report->warped_after <= report->warped_before);
            if (report->warped_before == 0) CHECK(mesh.positions == start);
            for (Index v = 0; v < mesh.vertex_count(); ++v)
                if (topology.on_boundary[v]) CHECK(mesh.positions[v] == start[v]);
            CHECK(max_hanging_deviation(mesh.hanging, mesh.positions) < 1e-14);
            check_cells_kept(old_cells, compute_cell_validities(mesh, context.parallel()), options);
            // Once more finds what was left, and no face that became warped.
            const auto again = flatten_faces(mesh, topology, options, context);
            REQUIRE(again);
            CHECK(again->warped_before == report->warped_after);
        }
    CHECK(before > 100);
    CHECK(after < before / 2);
    CHECK(moved > 0);
}

TEST_CASE("cells that are in the way of flattening a face give way") {
    std::size_t before = 0, after = 0;
    for (const char* name : {"grid", "octree-sphere", "octree-halved"})
        for (std::uint64_t seed = 0; seed < 10; ++seed) {
            HexMesh mesh = shaken(name, seed, 0.9);
            const Topology topology = compute_topology(mesh);
            Context context(1);
            const auto old_cells = compute_cell_validities(mesh, context.parallel());
            const FlattenOptions options;
            const auto report = flatten_faces(mesh, topology, options, context);
            REQUIRE(report);
            before += report->warped_before;
            after += report->warped_after;
            check_cells_kept(old_cells, compute_cell_validities(mesh, context.parallel()), options);
        }
    CHECK(before > 2000);
    CHECK(after <= 10); // 23 where only vertices of the two cells move
}

TEST_CASE("flattening ends the same for any number of threads, and can be cancelled") {
    std::vector<Point> first;
    for (int threads : {1, 2}) {
        HexMesh mesh = shaken("octree-sphere", 3, 0.65);
        Context context(threads);
        REQUIRE(flatten_faces(mesh, compute_topology(mesh), {}, context));
        if (threads == 1) first = mesh.positions;
        CHECK(mesh.positions == first);
    }
    HexMesh mesh = shaken("octree-sphere", 3, 0.65);
    Context context(1);
    context.cancel();
    const auto cancelled = flatten_faces(mesh, compute_topology(mesh), {}, context);
    REQUIRE(!cancelled);
    CHECK(cancelled.error().code == ErrorCode::cancelled);
}

namespace {

/// Two cells, one upon the other, whose common face is warped along the edges of their prism, and wider by
/// `flare` than their other ends.
HexMesh warped_tower(double flare) {
    HexMesh mesh;
    for (int z = 0; z < 3; ++z)
        for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
            const double half = 0.5 + (z == 1 ? flare : 0);
            mesh.positions.emplace_back(half * x, half * y, z);
        }
    mesh.cells = {{0, 1, 2, 3, 4, 5, 6, 7}, {4, 5, 6, 7, 8, 9, 10, 11}};
    for (Index k = 0; k < 4; ++k) mesh.positions[4 + k].z = 1 + (k % 2 == 0 ? 0.55 : -0.55);
    return mesh;
}

} // namespace

TEST_CASE("vertices of the boundary slide where moving others does not flatten a face") {
    HexMesh mesh = warped_tower(0);
    const Topology topology = compute_topology(mesh);
    Context context(1);
    const auto model = build_boundary_model(mesh, topology, {}, context);
    REQUIRE(model);
    const std::vector<Point> start = mesh.positions;
    FlattenOptions options;
    const auto stays = flatten_faces(mesh, topology, options, context);
    REQUIRE(stays);
    CHECK(stays->warped_after == 1);
    CHECK(mesh.positions == start);
    options.model = &*model;
    const auto slides = flatten_faces(mesh, topology, options, context);
    REQUIRE(slides);
    CHECK(slides->warped_after == 0);
    CHECK(slides->slid > 0);
    for (Index v = 0; v < 12; ++v) {
        CHECK(mesh.positions[v].x == Approx(start[v].x).margin(1e-12));
        CHECK(mesh.positions[v].y == Approx(start[v].y).margin(1e-12));
        if (v < 4 || v >= 8) CHECK(mesh.positions[v] == start[v]); // corners
    }
}

TEST_CASE("vertices of the boundary do not slide where edges or quads would leave the surface for it") {
    for (const bool may : {false, true}) {
        HexMesh mesh = warped_tower(0.05); // the edges of the tower bend at the vertices of the face
        const Topology topology = compute_topology(mesh);
        Context context(1);
        const auto model = build_boundary_model(mesh, topology, {}, context);
        REQUIRE(model);
        const std::vector<Point> start = mesh.positions;
        FlattenOptions options;
        options.model = &*model;
        options.slack_rel = may ? 0.05 : 1e-4;
        const auto report = flatten_faces(mesh, topology, options, context);
        REQUIRE(report);
        CHECK(report->warped_before == 1);
        SurfaceQuads quads(mesh, topology, *model);
        double farthest = 0;
        for (Index q = 0; q < quads.size(); ++q) farthest = std::max(farthest, quads.distance(q));
        CHECK(farthest <= options.slack_rel * model->diagonal());
        CHECK((mesh.positions == start) == !may);
        CHECK(report->warped_after == (may ? 0 : 1));
    }
}
