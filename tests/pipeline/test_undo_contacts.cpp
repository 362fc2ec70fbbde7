#include "pipeline/undo_contacts.hpp"

#include "quality/mesh_validity.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <catch2/catch.hpp>

namespace hexopt {

namespace {

constexpr Index kLength = 12;

/// Two bars of unit cells, one above the other, joined at x < 1 by a cell: a gap of height 1 between them.
struct Fork {
    HexMesh mesh;
    Topology topology;

    static Index id(Index i, Index j, Index k) { return i + (kLength + 1) * (j + 4 * k); }

    Fork() {
        for (Index k = 0; k < 2; ++k)
            for (Index j = 0; j < 4; ++j)
                for (Index i = 0; i <= kLength; ++i) mesh.positions.emplace_back(i, j, k);
        for (Index j = 0; j < 3; ++j)
            for (Index i = 0; i < kLength; ++i)
                if (j != 1 || i == 0)
                    mesh.cells.push_back({id(i, j, 0), id(i + 1, j, 0), id(i + 1, j + 1, 0), id(i, j + 1, 0),
                                          id(i, j, 1), id(i + 1, j, 1), id(i + 1, j + 1, 1),
                                          id(i, j + 1, 1)});
        topology = compute_topology(mesh);
    }

    std::size_t contacts() const { return find_boundary_contacts(mesh, topology, Parallel(1)).size(); }
};

} // namespace

TEST_CASE("moves that bring a boundary into contact go back, those elsewhere stay") {
    Fork fork;
    const std::vector<Point> before = fork.mesh.positions;
    for (Point& p : fork.mesh.positions) p.z *= 1.1;
    const Index low = Fork::id(9, 1, 0), high = Fork::id(9, 2, 0);
    fork.mesh.positions[low].y += 0.6;
    fork.mesh.positions[high].y -= 0.5;
    REQUIRE(fork.contacts() > 0);
    const std::vector<Point> after = fork.mesh.positions;
    const std::size_t back = undo_contacts(fork.mesh, fork.topology, before, 0.25, Parallel(1));
    CHECK(fork.contacts() == 0);
    CHECK(fork.mesh.positions[low] == before[low]);
    CHECK(fork.mesh.positions[high] == before[high]);
    std::size_t moved = 0;
    for (Index v = 0; v < fork.mesh.vertex_count(); ++v) {
        CHECK((fork.mesh.positions[v] == before[v] || fork.mesh.positions[v] == after[v]));
        moved += fork.mesh.positions[v] != before[v];
    }
    CHECK(moved > 4 * kLength / 2);
    CHECK(back > 2);
    CHECK(compute_validity(fork.mesh, Parallel(1)).is_valid());
}

TEST_CASE("moves that bring nothing into contact stay, and contacts that were there do not count") {
    Fork fork;
    const std::vector<Point> before = fork.mesh.positions;
    for (Point& p : fork.mesh.positions) p.z *= 1.1;
    const std::vector<Point> after = fork.mesh.positions;
    CHECK(undo_contacts(fork.mesh, fork.topology, before, 0.25, Parallel(1)) == 0);
    CHECK(fork.mesh.positions == after);

    Fork touching;
    for (Index k = 0; k < 2; ++k) touching.mesh.positions[Fork::id(9, 1, k)].y += 1.2;
    const std::size_t contacts = touching.contacts();
    REQUIRE(contacts > 0);
    const std::vector<Point> start = touching.mesh.positions;
    for (Index k = 0; k < 2; ++k) touching.mesh.positions[Fork::id(2, 1, k)].y += 1.2;
    REQUIRE(touching.contacts() > contacts);
    CHECK(undo_contacts(touching.mesh, touching.topology, start, 0.25, Parallel(1)) > 0);
    CHECK(touching.contacts() == contacts);
    CHECK(touching.mesh.positions[Fork::id(9, 1, 0)] == start[Fork::id(9, 1, 0)]);
}

} // namespace hexopt
