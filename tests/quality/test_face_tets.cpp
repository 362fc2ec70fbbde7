#include "quality/face_tets.hpp"

#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>

using namespace hexopt;
using Catch::Detail::Approx;

namespace {

PolyhedralFaces faces_of(const HexMesh& mesh) {
    auto faces = compute_polyhedral_faces(mesh, compute_topology(mesh), Parallel(1));
    REQUIRE(faces);
    return std::move(*faces);
}

/// Two cells of unit width, one above the other; the upper one's top is `top` wide.
HexMesh tower(double top) {
    HexMesh mesh;
    for (int k = 0; k < 3; ++k) {
        const double half = 0.5 * (k == 2 ? top : 1);
        for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)})
            mesh.positions.emplace_back(half * x, half * y, k);
    }
    mesh.cells = {{0, 1, 2, 3, 4, 5, 6, 7}, {4, 5, 6, 7, 8, 9, 10, 11}};
    return mesh;
}

} // namespace

TEST_CASE("centres of cells with plane faces are their centroids") {
    for (double top : {1.0, 0.5, 0.1}) {
        const HexMesh mesh = tower(top);
        const PolyhedralFaces faces = faces_of(mesh);
        const FaceTets tets(faces, mesh.cell_count());
        const CellCentre centre = tets.centre(1, mesh.positions);
        const double sum = 1 + top + top * top; // frustum of a pyramid
        CHECK(centre.volume == Approx(sum / 3));
        CHECK(centre.point.z == Approx(1 + (1 + 2 * top + 3 * top * top) / (4 * sum)));
        CHECK(centre.point.x == Approx(0).margin(1e-15));
    }
}

TEST_CASE("margins of a cube's faces are those of its tetrahedra") {
    const HexMesh mesh = tower(1);
    const PolyhedralFaces faces = faces_of(mesh);
    const FaceTets tets(faces, mesh.cell_count());
    for (std::size_t f = 0; f < faces.count(); ++f) CHECK(tets.margin(f, mesh.positions) == Approx(1.0 / 12));
    CHECK(tets.find_warped(mesh.positions, 1e-3, Parallel(1)).empty());
}

TEST_CASE("a face is warped where no way of cutting it suits both cells") {
    HexMesh mesh = tower(1);
    const PolyhedralFaces faces = faces_of(mesh);
    const FaceTets tets(faces, mesh.cell_count());
    REQUIRE(faces.internal_count() == 1);
    // Two opposite corners up, the others down: the lower cell's centre sees the face along one diagonal
    // only, the upper one's along the other.
    for (const auto& [height, warped] : {std::pair(0.3, false), std::pair(0.55, true)}) {
        for (Index k = 0; k < 4; ++k) mesh.positions[4 + k].z = 1 + (k % 2 == 0 ? height : -height);
        CHECK((tets.margin(0, mesh.positions) <= 0) == warped);
        CHECK(tets.find_warped(mesh.positions, 0, Parallel(2)).size() == (warped ? 1 : 0));
    }
    mesh.positions[4].z = 5; // turned over
    CHECK(tets.margin(0, mesh.positions) <= 0);
}

TEST_CASE("a face is warped that can be cut from a corner but not from its centre") {
    HexMesh mesh;
    mesh.positions = {{0, 0, 0},     {1, 0, 0},       {1, 1, 0},       {0, 1, 0},
                      {0, 0.3, 0.7}, {0.9, 0.1, 0.8}, {0.6, 1.7, 1.2}, {0.4, 0.5, 1.1}};
    mesh.cells = {{0, 1, 2, 3, 4, 5, 6, 7}};
    const PolyhedralFaces faces = faces_of(mesh);
    const FaceTets tets(faces, mesh.cell_count());
    const CellCentre centre = tets.centre(0, mesh.positions);
    const std::vector<std::size_t> warped = tets.find_warped(mesh.positions, 0, Parallel(1));
    REQUIRE(warped.size() == 1);
    std::array<Point, 4> x;
    for (int k = 0; k < 4; ++k) x[k] = mesh.positions[tets.corners(warped.front())[k]] - centre.point;
    const auto is_positive = [](const Point& a, const Point& b, const Point& c) {
        return glm::dot(glm::cross(a, b), c) > 0.01;
    };
    const bool from_0 = is_positive(x[0], x[1], x[2]) && is_positive(x[0], x[2], x[3]);
    const bool from_1 = is_positive(x[1], x[2], x[3]) && is_positive(x[1], x[3], x[0]);
    CHECK((from_0 || from_1));
}

TEST_CASE("perfect octrees have no warped faces, whatever hangs") {
    for (const char* name : {"octree-corner", "octree-sphere", "octree-halved", "octree-trimmed"}) {
        Context context(1);
        const auto mesh = make_sample(name, {}, context);
        REQUIRE(mesh);
        const PolyhedralFaces faces = faces_of(*mesh);
        const FaceTets tets(faces, mesh->cell_count());
        CHECK(tets.find_warped(mesh->positions, 1e-3, context.parallel()).empty());
    }
}
