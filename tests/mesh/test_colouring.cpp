#include "mesh/colouring.hpp"

#include "mesh/hanging.hpp"
#include "mesh_oracles.hpp"
#include "random_remap.hpp"

#include <set>

using namespace hexopt;
using namespace hexopt::test;

namespace {

/// Free vertices that each cell depends on, from the definition.
std::vector<std::set<Index>> vertices_of_cells(const HexMesh& mesh) {
    const auto row_of = compute_hanging_row(mesh.hanging, mesh.vertex_count());
    std::vector<std::set<Index>> vertices(mesh.cell_count());
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (Index v : mesh.cells[c]) {
            const Index row = row_of.empty() ? kNoIndex : row_of[v];
            if (row == kNoIndex)
                vertices[c].insert(v);
            else
                for (std::size_t i = mesh.hanging.offset[row]; i < mesh.hanging.offset[row + 1]; ++i)
                    vertices[c].insert(mesh.hanging.master[i]);
        }
    return vertices;
}

void check_colouring(const HexMesh& mesh, const Colouring& colouring) {
    for (const auto& vertices : vertices_of_cells(mesh)) {
        std::set<std::uint16_t> seen;
        for (Index v : vertices)
            if (colouring.colour[v] != kNoColour) REQUIRE(seen.insert(colouring.colour[v]).second);
    }
    std::size_t listed = 0;
    for (std::size_t c = 0; c < colouring.count(); ++c) {
        const auto row = colouring.vertices[c];
        REQUIRE_FALSE(row.empty());
        if (c > 0) REQUIRE(row.size() <= colouring.vertices[c - 1].size());
        REQUIRE(std::is_sorted(row.begin(), row.end()));
        for (Index v : row) REQUIRE(colouring.colour[v] == c);
        listed += row.size();
    }
    REQUIRE(listed == std::size_t(std::count_if(colouring.colour.begin(), colouring.colour.end(),
                                                [](std::uint16_t c) { return c != kNoColour; })));
}

/// Cells that share one edge, as pages a spine: needs as many colours as vertices.
HexMesh fan(Index pages) {
    HexMesh mesh;
    mesh.positions.assign(2 + 6 * pages, Point(0));
    for (Index p = 0; p < pages; ++p) {
        const Index f = 2 + 6 * p;
        mesh.cells.push_back({0, f, f + 1, f + 2, 1, f + 3, f + 4, f + 5});
    }
    return mesh;
}

} // namespace

TEST_CASE("colourings of grids and octrees are valid and small") {
    std::vector<std::string> names = kOctrees;
    names.push_back("grid");
    for (const std::string& name : names)
        for (bool inner_only : {false, true}) {
            CAPTURE(name, inner_only);
            const HexMesh mesh = sample(name, {.size = 6});
            const Topology topology = compute_topology(mesh);
            const Stencils stencils = compute_stencils(mesh, topology);
            std::vector<std::uint8_t> movable;
            if (inner_only)
                for (std::uint8_t on_boundary : topology.on_boundary) movable.push_back(!on_boundary);
            const Colouring colouring = compute_colouring(mesh, topology, stencils, movable);
            check_colouring(mesh, colouring);
            for (Index v = 0; v < mesh.vertex_count(); ++v) {
                const bool wanted = !stencils.ball(v).empty() && (!inner_only || movable[v]);
                REQUIRE((colouring.colour[v] != kNoColour) == wanted);
            }
            CHECK(colouring.count() <= (name == "grid" ? 8u : 16u));
        }
}

TEST_CASE("colourings of meshes in random numbering are valid") {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        const HexMesh ordered = sample(seed % 2 ? "octree-halved" : "grid", {.size = 4});
        const HexMesh mesh = apply_remap(ordered, random_remap(ordered, seed));
        const Topology topology = compute_topology(mesh);
        const Stencils stencils = compute_stencils(mesh, topology);
        const Colouring colouring = compute_colouring(mesh, topology, stencils);
        check_colouring(mesh, colouring);
        CHECK(colouring.colour == compute_colouring(mesh, topology, stencils).colour);
    }
}

TEST_CASE("more than 64 colours where a mesh needs them") {
    // One corner of a cell hangs on 100 vertices: they conflict with one another and with the other corners.
    HexMesh mesh = fan(1);
    const Index masters = 100;
    Hanging rows;
    std::vector<Index> ids;
    for (Index i = 0; i < masters; ++i) ids.push_back(static_cast<Index>(mesh.positions.size()) + i);
    append_row(rows, 2, ids, std::vector<double>(masters, 1.0 / masters));
    mesh.positions.resize(mesh.positions.size() + masters, Point(0));
    auto closed = close_hanging(rows, mesh.vertex_count());
    REQUIRE(closed);
    mesh.hanging = *closed;
    const Topology topology = compute_topology(mesh);
    const Colouring colouring = compute_colouring(mesh, topology, compute_stencils(mesh, topology));
    check_colouring(mesh, colouring);
    CHECK(colouring.count() == masters + 7);
}

TEST_CASE("a fan of cells takes eight colours however many share its spine") {
    const HexMesh mesh = fan(300);
    const Topology topology = compute_topology(mesh);
    const Colouring colouring = compute_colouring(mesh, topology, compute_stencils(mesh, topology));
    check_colouring(mesh, colouring);
    CHECK(colouring.count() == 8);
}
