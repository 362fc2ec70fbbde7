#include "stages/optimize/contact_guard.hpp"
#include "stages/optimize/deviation_guard.hpp"

#include "mesh/hanging.hpp"
#include "mesh/topology.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace hexopt;

namespace {

/// A C of seven unit cells: columns 0..2, rows 0..2, the cells (1, 1) and (2, 1) are missing.
struct LetterC {
    HexMesh mesh;
    Topology topology;
    std::vector<Quad> quads;
    Csr<Index> vertex_quad;

    static Index id(Index i, Index j, Index k) { return i + 4 * (j + 4 * k); }

    explicit LetterC(double gap = 1) {
        for (Index k = 0; k < 2; ++k)
            for (Index j = 0; j < 4; ++j)
                for (Index i = 0; i < 4; ++i) mesh.positions.emplace_back(i, j < 2 ? j : j - 1 + gap, k);
        for (Index j = 0; j < 3; ++j)
            for (Index i = 0; i < 3; ++i)
                if (i == 0 || j != 1)
                    mesh.cells.push_back({id(i, j, 0), id(i + 1, j, 0), id(i + 1, j + 1, 0), id(i, j + 1, 0),
                                          id(i, j, 1), id(i + 1, j, 1), id(i + 1, j + 1, 1),
                                          id(i, j + 1, 1)});
        topology = compute_topology(mesh);
        vertex_quad.offset.assign(mesh.vertex_count() + 1, 0);
        for (CellFace face : topology.boundary_faces) quads.push_back(face_vertices(mesh, face));
        for (Index v = 0; v < mesh.vertex_count(); ++v) {
            for (Index q = 0; q < quads.size(); ++q)
                if (std::find(quads[q].begin(), quads[q].end(), v) != quads[q].end())
                    vertex_quad.item.push_back(q);
            vertex_quad.offset[v + 1] = vertex_quad.item.size();
        }
    }

    std::size_t contacts(const std::vector<Point>& moved, double deviation = 1) const {
        const Parallel parallel(1);
        const ContactGuard guard(mesh, topology, quads, vertex_quad, mesh.positions, deviation, parallel);
        std::vector<Index> all(quads.size());
        for (Index q = 0; q < quads.size(); ++q) all[q] = q;
        return guard.touching(moved, all, parallel).size();
    }
};

} // namespace

TEST_CASE("a boundary that stays apart is not in contact") {
    const LetterC c;
    CHECK(c.contacts(c.mesh.positions) == 0);
    std::vector<Point> moved = c.mesh.positions;
    for (Index k = 0; k < 2; ++k)
        for (Index i = 2; i < 4; ++i) moved[LetterC::id(i, 2, k)].y -= 0.9;
    CHECK(c.contacts(moved) == 0);
}

TEST_CASE("a gap that closes or is crossed is a contact") {
    const LetterC c;
    const double way = GENERATE(0.99, 1.0, 1.4);
    std::vector<Point> moved = c.mesh.positions;
    SECTION("everywhere") {
        for (Index k = 0; k < 2; ++k)
            for (Index i = 2; i < 4; ++i) moved[LetterC::id(i, 2, k)].y -= way;
    }
    SECTION("at one vertex") { moved[LetterC::id(3, 2, 0)].y -= way; }
    CHECK(c.contacts(moved) >= 2);
}

TEST_CASE("quads at an edge that fold together are in contact") {
    const LetterC c;
    std::vector<Point> moved = c.mesh.positions;
    // The gap's end wall shrinks to an edge: its upper side comes down onto its lower side.
    for (Index k = 0; k < 2; ++k) {
        moved[LetterC::id(1, 2, k)] = {1, 1.5, k};
        moved[LetterC::id(1, 1, k)] = {1, 1.49, k};
        moved[LetterC::id(2, 2, k)] = {2, 1.51, k};
        moved[LetterC::id(2, 1, k)] = {2, 1.48, k};
    }
    CHECK(c.contacts(moved) >= 2);
}

TEST_CASE("what touches at the start may go on touching") {
    const LetterC c(0.001);
    CHECK(c.contacts(c.mesh.positions) == 0);
    const LetterC plate; // thin, but solid between its faces
    std::vector<Point> moved = plate.mesh.positions;
    for (Index j = 0; j < 4; ++j)
        for (Index i = 0; i < 4; ++i) moved[LetterC::id(i, j, 1)].z = 0.001;
    CHECK(plate.contacts(moved) == 0);
}

TEST_CASE("a finished boundary is searched for contacts: narrow gaps are none, closed and crossed ones are") {
    const Parallel parallel(1);
    const auto count = [&](const LetterC& c) {
        return find_boundary_contacts(c.mesh, c.topology, parallel).size();
    };
    CHECK(count(LetterC(1)) == 0);
    CHECK(count(LetterC(0.005)) == 0);
    CHECK(count(LetterC(0.0005)) >= 4);
    LetterC crossed;
    crossed.mesh.positions[LetterC::id(3, 2, 0)].y -= 1.4;
    CHECK(count(crossed) >= 2);
}

namespace {

/// Contacts of five cells round an edge of the axis, all but `gap` of the full turn; at the upper end of the
/// edge all but `gap_above`.
std::size_t count_slit_contacts(double gap, double gap_above) {
    HexMesh mesh;
    const int sectors = 5;
    for (int k = 0; k < 2; ++k) {
        const double step = (2 * std::numbers::pi - (k == 0 ? gap : gap_above)) / (2 * sectors);
        mesh.positions.emplace_back(0, 0, k);
        for (int i = 0; i <= 2 * sectors; ++i) {
            const double radius = i % 2 == 0 ? 1 : 1.2;
            mesh.positions.emplace_back(radius * std::cos(i * step), radius * std::sin(i * step), k);
        }
    }
    const Index layer = 2 * sectors + 2;
    for (Index i = 0; i < sectors; ++i) {
        const Index a = 1 + 2 * i;
        mesh.cells.push_back({0, a, a + 1, a + 2, layer, layer + a, layer + a + 1, layer + a + 2});
    }
    return find_boundary_contacts(mesh, compute_topology(mesh), Parallel(1)).size();
}

} // namespace

TEST_CASE("two sides of a slit are in contact from their common edge on") {
    CHECK(count_slit_contacts(0.5, 0.5) == 0);
    CHECK(count_slit_contacts(0.02, 0.02) == 0);
    CHECK(count_slit_contacts(0.002, 0.002) == 2); // a quarter into the quads 0.0005 wide
}

TEST_CASE("warped sides of a slit are in contact where they cross from their common edge on") {
    CHECK(count_slit_contacts(0.5, 0.1) == 0);
    const double overlap = GENERATE(0.01, 0.1, 0.5, 1.0);
    CHECK(count_slit_contacts(0.1, -overlap) >= 2);
    CHECK(count_slit_contacts(1.0, -overlap) >= 2);
}

TEST_CASE("two sides of a solid plate that is next to nothing thick lie on one another") {
    LetterC plate;
    const auto count = [&](double thickness) {
        for (Index j = 0; j < 4; ++j)
            for (Index i = 0; i < 4; ++i) plate.mesh.positions[LetterC::id(i, j, 1)].z = thickness;
        return find_boundary_contacts(plate.mesh, plate.topology, Parallel(1)).size();
    };
    CHECK(count(0.002) == 0);
    CHECK(count(0.0005) == 14);
}

TEST_CASE("a corner turned over onto the neighbour is found, though the quads themselves face alike") {
    HexMesh mesh; // two cubes side by side
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 3; ++i) mesh.positions.emplace_back(i, j, k);
    for (Index i = 0; i < 2; ++i) mesh.cells.push_back({i, i + 1, i + 4, i + 3, i + 6, i + 7, i + 10, i + 9});
    const Topology topology = compute_topology(mesh);
    const std::vector<Quad> quads = {{6, 7, 10, 9}, {7, 8, 11, 10}}; // on top
    Csr<Index> vertex_quad;
    for (Index v = 0; v < 12; ++v) {
        for (Index q = 0; q < 2; ++q)
            if (std::find(quads[q].begin(), quads[q].end(), v) != quads[q].end())
                vertex_quad.item.push_back(q);
        vertex_quad.offset.push_back(vertex_quad.item.size());
    }
    const ContactGuard guard(mesh, topology, quads, vertex_quad, kTouching);
    const std::vector<Index> both = {0, 1};
    CHECK(guard.touching(mesh.positions, both, Parallel(1)).empty());
    std::vector<Point> moved = mesh.positions;
    moved[6] = {0.9, 0.3, 1};
    CHECK(guard.touching(moved, both, Parallel(1)).empty()); // bent, but beside its neighbour
    moved[6] = {1.6, 0.3, 1};
    CHECK(guard.touching(moved, both, Parallel(1)) == both);
}

TEST_CASE("what is near at the start may go on so, but not come to touch") {
    const LetterC c(0.01);
    CHECK(c.contacts(c.mesh.positions) == 0);
    std::vector<Point> moved = c.mesh.positions;
    const auto close_to = [&](double gap) {
        for (Index k = 0; k < 2; ++k)
            for (Index i = 2; i < 4; ++i) moved[LetterC::id(i, 2, k)].y = 1 + gap;
    };
    close_to(0.004);
    CHECK(c.contacts(moved) == 0);
    close_to(0.0005);
    CHECK(c.contacts(moved) >= 2);
}

TEST_CASE("a quad and the smaller ones along its edge are neighbours, not in contact") {
    // A unit cube, and on its side x = 1 the lower two of four cubes half as large: a step of 90 degrees at
    // their edge, in the middle of which a vertex hangs.
    HexMesh mesh;
    std::vector<Index> at(5 * 5 * 5, kNoIndex);
    const auto id = [&](int i, int j, int k) {
        Index& v = at[static_cast<std::size_t>((k * 5 + j) * 5 + i)];
        if (v == kNoIndex) {
            v = static_cast<Index>(mesh.positions.size());
            mesh.positions.emplace_back(0.5 * i, 0.5 * j, 0.5 * k);
        }
        return v;
    };
    const auto add = [&](int i, int j, int k, int s) {
        mesh.cells.push_back({id(i, j, k), id(i + s, j, k), id(i + s, j + s, k), id(i, j + s, k),
                              id(i, j, k + s), id(i + s, j, k + s), id(i + s, j + s, k + s),
                              id(i, j + s, k + s)});
    };
    add(0, 0, 0, 2);
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 2; ++j) add(2, j, k, 1);
    add(0, 0, 2, 2);
    const std::array<Index, 2> low{id(2, 0, 0), id(2, 2, 0)}, high{id(2, 0, 2), id(2, 2, 2)},
        left{id(2, 0, 0), id(2, 0, 2)}, right{id(2, 2, 0), id(2, 2, 2)};
    const std::array<double, 2> half{0.5, 0.5};
    Hanging rows;
    append_row(rows, id(2, 1, 0), low, half);
    append_row(rows, id(2, 1, 2), high, half);
    append_row(rows, id(2, 0, 1), left, half);
    append_row(rows, id(2, 2, 1), right, half);
    const std::array<Index, 4> all{low[0], low[1], high[0], high[1]};
    const std::array<double, 4> quarter{0.25, 0.25, 0.25, 0.25};
    append_row(rows, id(2, 1, 1), all, quarter);
    auto closed = close_hanging(rows, mesh.vertex_count());
    REQUIRE(closed);
    mesh.hanging = std::move(*closed);
    const Topology topology = compute_topology(mesh);
    REQUIRE(topology.boundary_faces.size() == 4 + 12 + 5);
    CHECK(find_boundary_contacts(mesh, topology, Parallel(1)).empty());
}

TEST_CASE("a hollow between the places that a guard looks at is found before a state is kept") {
    // One cell over a box whose top lies a little lower and may have a hole between the places.
    for (const bool has_hole : {false, true}) {
        HexMesh mesh;
        TriangleSoup box;
        const auto add_quad = [&](Index a, Index b, Index c, Index d) {
            box.triangles.push_back({a, b, c});
            box.triangles.push_back({a, c, d});
        };
        for (int k = 0; k < 8; ++k) {
            const double x = k % 4 == 1 || k % 4 == 2, y = k % 4 >= 2;
            mesh.positions.emplace_back(x, y, k / 4);
            box.vertices.emplace_back(x, y, k < 4 ? 0 : 0.975);
        }
        mesh.cells.push_back({0, 1, 2, 3, 4, 5, 6, 7});
        add_quad(0, 3, 2, 1);
        for (Index k = 0; k < 4; ++k) add_quad(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k);
        for (const auto& [x, y] : {std::pair{0.525, 0.525}, {0.725, 0.525}, {0.725, 0.725}, {0.525, 0.725}})
            box.vertices.emplace_back(x, y, 0.975);
        for (Index k = 0; k < 4; ++k) add_quad(4 + k, 4 + (k + 1) % 4, 8 + (k + 1) % 4, 8 + k);
        if (!has_hole) add_quad(8, 9, 10, 11);
        const Topology topology = compute_topology(mesh);
        Context context(1);
        const auto surface = build_boundary_model(mesh, topology, box, {}, context);
        REQUIRE(surface);
        const SurfaceLimits limits = unlimited_on_surface(mesh.positions);
        const DeviationGuard guard(mesh, topology, *surface, limits, 0.05, context.parallel());
        CHECK(guard.violators(mesh.positions, guard.boundary_vertices(), context.parallel()).empty());
        CHECK(guard.is_within(mesh.positions, 1, context.parallel()) == !has_hole);
    }
}
