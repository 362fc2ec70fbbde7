#include "mesh/topology.hpp"

#include "mesh_oracles.hpp"

#include <map>

using namespace hexopt;
using namespace hexopt::test;

namespace {

void check_vertex_cell(const HexMesh& mesh, const Topology& topology) {
    std::vector<std::vector<CellCorner>> expected(mesh.vertex_count());
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (std::uint32_t k = 0; k < 8; ++k) expected[mesh.cells[c][k]].push_back({c, k});
    REQUIRE(topology.vertex_cell.rows() == mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const auto row = topology.vertex_cell[v];
        REQUIRE(std::vector<CellCorner>(row.begin(), row.end()) == expected[v]);
    }
}

std::vector<CellFace> once_by_map(const HexMesh& mesh) {
    std::map<Quad, std::vector<CellFace>> users;
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (std::uint32_t f = 0; f < 6; ++f) {
            Quad key = face_vertices(mesh, {c, f});
            std::sort(key.begin(), key.end());
            users[key].push_back({c, f});
        }
    std::vector<CellFace> once;
    for (const auto& [key, faces] : users)
        if (faces.size() == 1) once.push_back(faces.front());
    std::sort(once.begin(), once.end());
    return once;
}

} // namespace

TEST_CASE("topology of a grid") {
    const HexMesh mesh = sample("grid-warped", {.size = 7});
    const Topology topology = compute_topology(mesh);
    check_vertex_cell(mesh, topology);
    CHECK(topology.boundary_faces == once_by_map(mesh));
    CHECK(topology.boundary_faces.size() == 6 * 49);
    CHECK(topology.coarse_faces.empty());
    CHECK(topology.hanging_row.empty());
    CHECK(std::count(topology.on_boundary.begin(), topology.on_boundary.end(), 1) == 8 * 8 * 8 - 6 * 6 * 6);
}

TEST_CASE("topology is the same for any number of threads") {
    const HexMesh mesh = sample("octree-halved", {.size = 8});
    const Topology one = compute_topology(mesh, Parallel(1)), four = compute_topology(mesh, Parallel(4));
    CHECK(one.boundary_faces == four.boundary_faces);
    CHECK(one.coarse_faces == four.coarse_faces);
    CHECK(one.fine_faces.item == four.fine_faces.item);
    CHECK(one.on_boundary == four.on_boundary);
}

TEST_CASE("the boundary of octrees encloses exactly the cells, fine faces cover coarse ones") {
    for (const std::string& name : kOctrees)
        for (bool scrambled : {false, true}) {
            CAPTURE(name, scrambled);
            const HexMesh mesh = sample(name, {.scrambled = scrambled});
            const Topology topology = compute_topology(mesh);
            check_vertex_cell(mesh, topology);
            REQUIRE_FALSE(topology.coarse_faces.empty());
            REQUIRE(topology.fine_faces.rows() == topology.coarse_faces.size());
            REQUIRE(once_by_map(mesh).size() == topology.boundary_faces.size() +
                                                    topology.coarse_faces.size() +
                                                    topology.fine_faces.item.size());
            double flux = 0;
            for (CellFace face : topology.boundary_faces) flux += flux_through(mesh, face);
            CHECK(flux == Approx(volume_of_cells(mesh)).epsilon(1e-10));
            for (std::size_t i = 0; i < topology.coarse_faces.size(); ++i) {
                double fine = 0;
                for (CellFace face : topology.fine_faces[i]) fine += flux_through(mesh, face);
                REQUIRE(fine == Approx(-flux_through(mesh, topology.coarse_faces[i])).margin(1e-12));
            }
        }
}

TEST_CASE("on_boundary of an octree on the unit cube is where the coordinates say") {
    const HexMesh mesh = sample("octree-corner");
    const Topology topology = compute_topology(mesh);
    std::size_t hanging_on_boundary = 0;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const Point& p = mesh.positions[v];
        bool expected = false;
        for (int axis = 0; axis < 3; ++axis) expected |= p[axis] == 0 || p[axis] == 1;
        REQUIRE(bool(topology.on_boundary[v]) == expected);
        hanging_on_boundary += expected && topology.hanging_row[v] != kNoIndex;
    }
    CHECK(hanging_on_boundary > 0);
}
