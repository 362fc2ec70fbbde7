#include "render/visible_faces.hpp"

#include "samples/grid.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>
#include <set>

using namespace hexopt;

namespace {

std::size_t count_cut(const std::vector<VisibleFace>& faces) {
    return static_cast<std::size_t>(
        std::count_if(faces.begin(), faces.end(), [](const VisibleFace& f) { return f.is_cut; }));
}

} // namespace

TEST_CASE("all cells show the boundary") {
    const HexMesh mesh = *make_grid({.cells = {3, 4, 5}}, Parallel(1));
    const Topology topology = compute_topology(mesh);
    const auto faces = find_visible_faces(mesh, topology, {}, Parallel(1));
    CHECK(faces.size() == 94);
    CHECK(count_cut(faces) == 0);
    CHECK(find_visible_faces(mesh, topology, std::vector<std::uint8_t>(60, 1), Parallel(2)) == faces);
    CHECK(find_visible_faces(mesh, topology, std::vector<std::uint8_t>(60, 0), Parallel(2)).empty());
}

TEST_CASE("any choice of a grid's cells shows a closed surface") {
    const HexMesh mesh = *make_grid({.cells = {6, 5, 4}}, Parallel(1));
    const Topology topology = compute_topology(mesh);
    std::mt19937_64 random(9);
    for (int n = 0; n < 50; ++n) {
        std::vector<std::uint8_t> keep(mesh.cell_count());
        for (auto& k : keep) k = random() % 3 != 0;
        const auto faces = find_visible_faces(mesh, topology, keep, Parallel(2));
        std::multiset<std::pair<Index, Index>> edges;
        for (const VisibleFace& visible : faces) {
            CHECK(keep[visible.face.cell]);
            const Quad q = face_vertices(mesh, visible.face);
            for (int k = 0; k < 4; ++k) edges.insert({q[k], q[(k + 1) % 4]});
        }
        for (const auto& [a, b] : edges) REQUIRE(edges.count({a, b}) == edges.count({b, a}));
    }
}

TEST_CASE("a cut through refinement levels uncovers coarse and fine faces") {
    Context context(1);
    const HexMesh mesh = *make_sample("octree-sphere", {}, context);
    const Topology topology = compute_topology(mesh);
    REQUIRE_FALSE(topology.coarse_faces.empty());
    // Without the coarse cells each fine face that bordered on them is uncovered, and the other way round.
    std::vector<std::uint8_t> is_coarse(mesh.cell_count(), 0), is_fine(mesh.cell_count(), 0);
    const Index coarse = topology.coarse_faces[0].cell;
    is_coarse[coarse] = 1;
    const auto alone = find_visible_faces(mesh, topology, is_coarse, Parallel(1));
    CHECK(alone.size() == 6);
    std::vector<std::uint8_t> rest(mesh.cell_count(), 1);
    rest[coarse] = 0;
    std::size_t uncovered = 0; // faces on the other side of the cell that was taken out
    for (std::uint32_t f = 0; f < 6; ++f) {
        std::size_t parts = 1;
        for (std::size_t i = 0; i < topology.coarse_faces.size(); ++i)
            if (topology.coarse_faces[i] == CellFace{coarse, f}) parts = topology.fine_faces[i].size();
        for (CellFace b : topology.boundary_faces)
            if (b == CellFace{coarse, f}) parts = 0;
        uncovered += parts;
    }
    CHECK(count_cut(find_visible_faces(mesh, topology, rest, Parallel(1))) == uncovered);
}
