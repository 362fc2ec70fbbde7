#include "mesh/hanging.hpp"
#include "mesh/renumber.hpp"
#include "mesh_oracles.hpp"
#include "random_remap.hpp"

using namespace hexopt;
using namespace hexopt::test;

namespace {

HexMesh with_patches(HexMesh mesh) {
    mesh.patch_names = {"low", "high"};
    for (CellFace face : compute_topology(mesh).boundary_faces)
        mesh.boundary.push_back({face_vertices(mesh, face), face.face % 2});
    return mesh;
}

void require_same_mesh(const HexMesh& a, const HexMesh& b) {
    REQUIRE(a.positions == b.positions);
    REQUIRE(a.cells == b.cells);
    REQUIRE(a.level == b.level);
    REQUIRE(a.patch_names == b.patch_names);
    require_same(a.hanging, b.hanging);
    REQUIRE(a.boundary.size() == b.boundary.size());
    for (std::size_t i = 0; i < a.boundary.size(); ++i) {
        REQUIRE(a.boundary[i].vertices == b.boundary[i].vertices);
        REQUIRE(a.boundary[i].patch == b.boundary[i].patch);
    }
}

/// Largest distance of vertex numbers in a cell, averaged over the cells.
double mean_span(const HexMesh& mesh) {
    double sum = 0;
    for (const Cell& cell : mesh.cells) {
        const auto [low, high] = std::minmax_element(cell.begin(), cell.end());
        sum += *high - *low;
    }
    return sum / static_cast<double>(mesh.cell_count());
}

bool is_permutation_of_all(std::vector<Index> order) {
    std::sort(order.begin(), order.end());
    for (Index i = 0; i < order.size(); ++i)
        if (order[i] != i) return false;
    return true;
}

} // namespace

TEST_CASE("a remap and its inverse give the mesh back, and composing them the identity") {
    for (const char* name : {"grid-warped", "octree-halved", "octree-trimmed"}) {
        const HexMesh mesh = with_patches(sample(name, {.size = 4}));
        const Remap there = random_remap(mesh, 3), back = invert(there);
        const HexMesh moved = apply_remap(mesh, there);
        CHECK(moved.revision != mesh.revision);
        require_same_mesh(apply_remap(moved, back), mesh);
        CHECK(compose(there, back).vertex_old2new == identity_remap(mesh).vertex_old2new);
        CHECK(compose(there, back).cell_old2new == identity_remap(mesh).cell_old2new);
        const Remap second = random_remap(mesh, 4);
        require_same_mesh(apply_remap(moved, second), apply_remap(mesh, compose(there, second)));
    }
}

TEST_CASE("what is derived from a mesh does not depend on its numbering") {
    for (const char* name : {"grid-warped", "octree-halved", "octree-trimmed"}) {
        CAPTURE(name);
        const HexMesh mesh = sample(name, {.size = 4});
        const Remap remap = random_remap(mesh, 9);
        const HexMesh moved = apply_remap(mesh, remap);
        CHECK(max_hanging_deviation(moved.hanging, moved.positions) < 1e-15);
        CHECK(volume_of_cells(moved) == Approx(volume_of_cells(mesh)).epsilon(1e-12));
        const Topology before = compute_topology(mesh), after = compute_topology(moved);
        CHECK(before.boundary_faces.size() == after.boundary_faces.size());
        CHECK(before.coarse_faces.size() == after.coarse_faces.size());
        CHECK(remap_values<std::uint8_t>(before.on_boundary, remap.vertex_old2new, remap.vertex_count) ==
              after.on_boundary);
        std::vector<CellFace> faces;
        for (CellFace face : before.boundary_faces)
            faces.push_back({remap.cell_old2new[face.cell], face.face});
        std::sort(faces.begin(), faces.end());
        CHECK(faces == after.boundary_faces);
    }
}

TEST_CASE("a remap that leaves cells out keeps what belongs to the rest") {
    const HexMesh mesh = with_patches(sample("grid", {.size = 3}));
    Remap remap = identity_remap(mesh);
    // Keep the 9 cells of the lowest layer and their 32 vertices, backwards.
    remap.cell_count = 9;
    remap.vertex_count = 32;
    for (Index c = 0; c < mesh.cell_count(); ++c) remap.cell_old2new[c] = c < 9 ? 8 - c : kNoIndex;
    for (Index v = 0; v < mesh.vertex_count(); ++v) remap.vertex_old2new[v] = v < 32 ? 31 - v : kNoIndex;
    const HexMesh layer = apply_remap(mesh, remap);
    CHECK(layer.cell_count() == 9);
    CHECK(volume_of_cells(layer) == Approx(1 / 3.0));
    CHECK(layer.level.size() == 9);
    CHECK(layer.boundary.size() == 9 + 4 * 3);
    CHECK(layer.cells[8][0] == 31);
}

TEST_CASE("renumberings are permutations that bring neighbours together") {
    for (const char* name : {"grid", "octree-halved"}) {
        CAPTURE(name);
        const HexMesh tidy = sample(name, {.size = 10});
        const HexMesh mesh = apply_remap(tidy, random_remap(tidy, 2));
        const Topology topology = compute_topology(mesh);
        for (const Remap& remap : {compute_spatial_order(mesh), compute_bandwidth_order(mesh, topology)}) {
            REQUIRE(is_permutation_of_all(remap.vertex_old2new));
            REQUIRE(is_permutation_of_all(remap.cell_old2new));
            CHECK(mean_span(apply_remap(mesh, remap)) < 0.35 * mean_span(mesh));
        }
    }
}

TEST_CASE("the colour order makes colours contiguous") {
    const HexMesh mesh = sample("octree-halved", {.size = 4});
    const Topology topology = compute_topology(mesh);
    const Colouring colouring = compute_colouring(mesh, topology, compute_stencils(mesh, topology));
    const Remap remap = compute_colour_order(mesh, colouring);
    REQUIRE(is_permutation_of_all(remap.vertex_old2new));
    const auto colours =
        remap_values<std::uint16_t>(colouring.colour, remap.vertex_old2new, remap.vertex_count);
    CHECK(std::is_sorted(colours.begin(), colours.end()));
    CHECK(colours.back() == kNoColour);
}

TEST_CASE("renumbering copes with unused vertices and separate parts") {
    HexMesh mesh = sample("grid", {.size = 2});
    const HexMesh other = mesh;
    const Index shift = static_cast<Index>(mesh.vertex_count()) + 5;
    mesh.positions.resize(shift, Point(7));
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (Cell cell : other.cells) {
        for (Index& v : cell) v += shift;
        mesh.cells.push_back(cell);
    }
    mesh.level.clear();
    for (const Remap& remap :
         {compute_spatial_order(mesh), compute_bandwidth_order(mesh, compute_topology(mesh))}) {
        REQUIRE(is_permutation_of_all(remap.vertex_old2new));
        REQUIRE(is_permutation_of_all(remap.cell_old2new));
        const HexMesh moved = apply_remap(mesh, remap);
        CHECK(volume_of_cells(moved) == Approx(2));
        for (std::size_t v = moved.vertex_count() - 5; v < moved.vertex_count(); ++v)
            CHECK(moved.positions[v] == Point(7));
    }
}
