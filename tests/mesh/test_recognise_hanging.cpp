#include "mesh/recognise_hanging.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "mesh_oracles.hpp"
#include "random_remap.hpp"

#include <glm/vec3.hpp>

using namespace hexopt;
using namespace hexopt::test;

namespace {

RecognisedHanging recognise(const HexMesh& mesh) {
    auto found = recognise_hanging(mesh, {}, Parallel(2));
    if (!found) FAIL(found.error().one_line());
    return std::move(found).value();
}

void add_box(HexMesh& mesh, const Point& low, const Point& high) {
    Cell cell;
    for (int k = 0; k < 8; ++k) {
        const Point p(hex::kVertexX[k] ? high.x : low.x, hex::kVertexY[k] ? high.y : low.y,
                      hex::kVertexZ[k] ? high.z : low.z);
        const auto at = std::find(mesh.positions.begin(), mesh.positions.end(), p);
        cell[k] = static_cast<Index>(at - mesh.positions.begin());
        if (at == mesh.positions.end()) mesh.positions.push_back(p);
    }
    mesh.cells.push_back(cell);
}

} // namespace

TEST_CASE("recognise_hanging finds exactly the constraints that octrees were made with") {
    for (const std::string& name : kOctrees)
        for (int levels : {1, 2, 3})
            for (int tangling : {0, 1, 2}) {
                CAPTURE(name, levels, tangling);
                SampleOptions options{.size = 4, .levels = levels};
                if (tangling == 1) options.tangled = 0.3;
                if (tangling == 2) options.scrambled = true;
                const HexMesh mesh = sample(name, options, 7);
                const RecognisedHanging found = recognise(mesh);
                require_same(found.hanging, mesh.hanging);
                CHECK(found.conflict_count == 0);
                CHECK(found.max_deviation < 1e-14);
            }
}

TEST_CASE("recognise_hanging does not depend on numbering, orientation of cells or the boundary's shape") {
    for (const std::string& name : kOctrees)
        for (std::uint64_t seed = 0; seed < 6; ++seed) {
            CAPTURE(name, seed);
            const HexMesh ordered = sample(name, {.size = 4, .scrambled = seed % 2 == 0}, seed);
            HexMesh mesh = apply_remap(ordered, random_remap(ordered, seed));
            turn_cells(mesh, seed);
            Random random(seed);
            for (Point& p : mesh.positions)
                p += Point(random.uniform(), random.uniform(), random.uniform()) * 0.05;
            apply_hanging(mesh, Parallel(1));
            const RecognisedHanging found = recognise(mesh);
            require_same(found.hanging, mesh.hanging);
            CHECK(found.conflict_count == 0);
            CHECK(compute_topology(mesh).boundary_faces.size() ==
                  compute_topology(ordered).boundary_faces.size());
        }
}

TEST_CASE("recognise_hanging survives single precision and vertices off the middle") {
    for (const std::string& name : kOctrees) {
        CAPTURE(name);
        HexMesh mesh = sample(name);
        const Hanging expected = mesh.hanging;
        for (Point& p : mesh.positions) p = Point(glm::vec3(p));
        require_same(recognise(mesh).hanging, expected);
        Random random(3);
        for (Index v : expected.vertex)
            mesh.positions[v] += 1e-4 * Point(random.uniform(), random.uniform(), random.uniform());
        const RecognisedHanging found = recognise(mesh);
        require_same(found.hanging, expected);
        CHECK(found.max_deviation > 1e-5);
    }
}

TEST_CASE("recognise_hanging finds a face split over several levels at once") {
    for (int parts : {2, 4, 8, 16}) {
        CAPTURE(parts);
        HexMesh mesh;
        add_box(mesh, Point(0), Point(1));
        const double h = 1.0 / parts;
        for (int i = 0; i < parts; ++i)
            for (int j = 0; j < parts; ++j)
                add_box(mesh, Point(1, i * h, j * h), Point(1.5, (i + 1) * h, (j + 1) * h));
        const RecognisedHanging found = recognise(mesh);
        CHECK(found.coarse_face_count == 1);
        REQUIRE(found.hanging.count() == std::size_t((parts + 1) * (parts + 1) - 4));
        CHECK(found.max_deviation == 0);
        mesh.hanging = found.hanging;
        CHECK(compute_topology(mesh).boundary_faces.size() == std::size_t(5 + parts * parts + 4 * parts));
    }
}

TEST_CASE("recognise_hanging yields nothing on conforming meshes") {
    for (const char* name : {"grid", "grid-graded", "grid-warped", "scrambled-cube"}) {
        CAPTURE(name);
        const RecognisedHanging found = recognise(sample(name, {.size = 9}));
        CHECK(found.hanging.empty());
        CHECK(found.coarse_face_count == 0);
    }
}

TEST_CASE("recognise_hanging yields nothing on flattened and fully random conforming meshes") {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        HexMesh mesh = sample("grid", {.size = 6});
        Random random(seed);
        for (Point& p : mesh.positions) {
            if (seed % 2)
                p = Point(random.uniform(), random.uniform(), random.uniform());
            else
                p[static_cast<int>(seed / 2 % 3)] = 0.5; // all cells squeezed into a plane
        }
        REQUIRE(recognise(mesh).hanging.empty());
    }
    HexMesh mesh = sample("grid", {.size = 5});
    for (Point& p : mesh.positions) p = Point(1);
    CHECK(recognise(mesh).hanging.empty());
}

TEST_CASE("recognise_hanging finds the middle of an edge along which two levels only touch") {
    HexMesh mesh;
    add_box(mesh, Point(0), Point(2));
    add_box(mesh, Point(2, 2, 0), Point(3, 3, 1));
    add_box(mesh, Point(2, 2, 1), Point(3, 3, 2));
    const RecognisedHanging found = recognise(mesh);
    CHECK(found.single_edge_count == 1);
    REQUIRE(found.hanging.count() == 1);
    CHECK(mesh.positions[found.hanging.vertex[0]] == Point(2, 2, 1));
}
