#include "buffer/fitted_shapes.hpp"
#include "mesh/mesh_oracles.hpp"

#include "stages/buffer/insert_sheet.hpp"
#include "stages/buffer/surface_regions.hpp"

using namespace hexopt;
using namespace hexopt::test;

namespace {

SheetMesh open(const FittedMesh& fitted) {
    auto mesh = open_sheet_mesh(fitted, Parallel(1));
    if (!mesh) FAIL(mesh.error().one_line());
    find_regions(*mesh);
    return std::move(mesh).value();
}

FittedMesh close(SheetMesh mesh, const FittedShape& shape) {
    auto fitted =
        close_sheet_mesh(std::move(mesh), origin_of(shape.fitted.mesh), shape.domain.model, Parallel(1));
    if (!fitted) FAIL(fitted.error().one_line());
    return std::move(fitted).value();
}

/// Octree on a cube of four roots with two finer levels near `focus`.
FittedShape make_octree(Point focus) {
    BoxShape shape{{4, 4, 4}, 2};
    shape.refine = [focus](Point p) { return glm::length(p - focus) < 1.3; };
    return fit_to_itself(make_mesh(shape));
}

Point centre_of(const SheetMesh& mesh, Index cell) {
    Point centre(0);
    for (Index v : mesh.cells[cell]) centre += 0.125 * mesh.positions[v];
    return centre;
}

/// Cells within a random ball, with the surface quads within another one.
SheetChoice random_choice(const SheetMesh& mesh, std::uint64_t seed) {
    Random random(seed);
    const Point centre = 4.0 * Point(random.uniform(), random.uniform(), random.uniform());
    const double radius = 0.8 + 2 * random.uniform(), b_radius = 3 * random.uniform();
    const Point b_centre = centre + Point(random.uniform(), random.uniform(), random.uniform()) - 0.5;
    SheetChoice choice;
    std::vector<std::uint8_t> in_a(mesh.cells.size(), 0);
    for (Index c = 0; c < mesh.cells.size(); ++c)
        if (glm::length(centre_of(mesh, c) - centre) < radius) choice.cells.push_back(c), in_a[c] = 1;
    for (Index q = 0; q < mesh.surface.size(); ++q) {
        const CellFace face = mesh.surface[q].face;
        if (in_a[face.cell] && glm::length(centre_of(mesh, face.cell) - b_centre) < b_radius)
            choice.quads.push_back(q);
    }
    return choice;
}

} // namespace

TEST_CASE("buffer: a sheet under one side of a cube") {
    const FittedShape cube = make_cube(4);
    SheetMesh mesh = open(cube.fitted);
    SheetChoice choice;
    choice.all_cells = true;
    for (Index q = 0; q < mesh.surface.size(); ++q)
        if (mesh.surface[q].region == 0) choice.quads.push_back(q);
    REQUIRE(choice.quads.size() == 16);
    REQUIRE(insert_sheet(mesh, choice, cube.domain.model, Parallel(1)).empty());
    const FittedMesh fitted = close(std::move(mesh), cube);
    CHECK(check_sound(fitted) == 2);
    CHECK(fitted.mesh.cell_count() == 5 * 16);
    CHECK(fitted.mesh.vertex_count() == 6 * 25);
    CHECK(fitted.ridges.size() == 8 * 4 + 4 * 5);
    std::map<EntityKind, int> kinds;
    for (Association a : fitted.association) ++kinds[a.kind];
    CHECK(kinds[EntityKind::corner] == 8);
    CHECK(kinds[EntityKind::curve] == 8 * 3 + 4 * 4);
    CHECK(kinds[EntityKind::patch] == 2 * 9 + 4 * 12);
    for (Index v = 0; v < fitted.mesh.vertex_count(); ++v) {
        const Point& x = fitted.mesh.positions[v];
        CHECK(glm::length(x - cube.domain.model.project(fitted.association[v], x).point) < 1e-12);
    }
}

TEST_CASE("buffer: a closed pillow inside the mesh touches nothing else") {
    const FittedShape cube = make_cube(5);
    SheetMesh mesh = open(cube.fitted);
    SheetChoice choice;
    for (Index c = 0; c < mesh.cells.size(); ++c)
        if (glm::length(centre_of(mesh, c) - Point(2.5)) < 0.1) choice.cells = {c};
    REQUIRE(choice.cells.size() == 1);
    REQUIRE(insert_sheet(mesh, choice, cube.domain.model, Parallel(1)).empty());
    const FittedMesh fitted = close(std::move(mesh), cube);
    CHECK(check_sound(fitted) == 2);
    CHECK(fitted.mesh.cell_count() == 125 + 6);
    CHECK(fitted.mesh.vertex_count() == 216 + 8);
    CHECK(fitted.ridges == cube.fitted.ridges);
    Context context(1);
    CHECK(volume_of_cells(fitted.mesh) == Approx(125));
}

TEST_CASE("buffer: sheets on octrees keep levels, constraints and the surface") {
    int inserted = 0, refused = 0;
    for (std::uint64_t seed = 1; seed <= 150; ++seed) {
        Random random(seed * 77);
        const FittedShape octree =
            make_octree(4.0 * Point(random.uniform(), random.uniform(), random.uniform()));
        SheetMesh mesh = open(octree.fitted);
        const std::size_t splits = mesh.splits.middles.size() + mesh.splits.centres.size();
        REQUIRE(splits == octree.fitted.mesh.hanging.count());
        for (std::uint64_t round = 0; round < 3; ++round) {
            const SheetChoice choice = random_choice(mesh, seed * 1000 + round);
            if (choice.cells.empty()) continue;
            const SheetMesh before = mesh;
            const auto problems = insert_sheet(mesh, choice, octree.domain.model, Parallel(1));
            if (!problems.empty()) {
                ++refused;
                CHECK(mesh.cells == before.cells);
                CHECK(mesh.positions == before.positions);
                continue;
            }
            ++inserted;
            INFO("seed " << seed << " round " << round);
            const FittedMesh fitted = close(mesh, octree);
            CHECK(check_sound(fitted) == 2);
            CHECK(max_hanging_deviation(fitted.mesh.hanging, fitted.mesh.positions) < 1e-12);
            CHECK(volume_of_cells(fitted.mesh) == Approx(64));
        }
    }
    CAPTURE(inserted, refused);
    CHECK(inserted > 100);
    CHECK(refused > 20);
}

TEST_CASE("buffer: a sheet that would touch itself is refused and nothing changes") {
    const FittedShape cube = make_cube(4);
    SheetMesh mesh = open(cube.fitted);
    const auto cell_at = [&](Point p) {
        for (Index c = 0; c < mesh.cells.size(); ++c)
            if (glm::length(centre_of(mesh, c) - p) < 0.1) return c;
        return kNoIndex;
    };
    SECTION("at an edge") {
        SheetChoice choice;
        choice.cells = {cell_at({1.5, 1.5, 1.5}), cell_at({2.5, 2.5, 1.5})};
        const auto problems = insert_sheet(mesh, choice, cube.domain.model, Parallel(1));
        REQUIRE(!problems.empty());
        CHECK(std::any_of(problems.begin(), problems.end(),
                          [](const SheetProblem& p) { return p.fault == SheetFault::crossed; }));
    }
    SECTION("at a vertex") {
        SheetChoice choice;
        choice.cells = {cell_at({1.5, 1.5, 1.5}), cell_at({2.5, 2.5, 2.5})};
        const auto problems = insert_sheet(mesh, choice, cube.domain.model, Parallel(1));
        REQUIRE(problems.size() == 1);
        CHECK(problems[0].fault == SheetFault::pinched);
        CHECK(glm::length(mesh.positions[problems[0].vertex] - Point(2)) < 1e-12);
    }
    CHECK(mesh.cells == cube.fitted.mesh.cells);
    CHECK(mesh.positions == cube.fitted.mesh.positions);
}
