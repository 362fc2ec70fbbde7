#include "pipeline/flatten_faces.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

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
            const auto new_cells = compute_cell_validities(mesh, context.parallel());
            for (std::size_t c = 0; c < new_cells.size(); ++c)
                CHECK((!is_worse(new_cells[c], old_cells[c]) ||
                       (new_cells[c].is_usable() && new_cells[c].scaled_jacobian >= options.last_min_sj)));
            // Once more finds what was left, and no face that became warped.
            const auto again = flatten_faces(mesh, topology, options, context);
            REQUIRE(again);
            CHECK(again->warped_before == report->warped_after);
        }
    CHECK(before > 100);
    CHECK(after < before / 2);
    CHECK(moved > 0);
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
