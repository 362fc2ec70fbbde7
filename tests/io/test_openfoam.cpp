#include "io/mesh_io.hpp"
#include "io/scratch.hpp"
#include "io/write_openfoam.hpp"
#include "mesh/hanging.hpp"
#include "mesh/polyhedral_faces.hpp"
#include "samples/samples.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <vtkCell.h>
#include <vtkNew.h>
#include <vtkPolyhedron.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

using namespace hexopt;
using test::slurp;
namespace fs = std::filesystem;

namespace {

HexMesh sample(const char* name, SampleOptions options = {}) {
    Context context(2);
    auto mesh = make_sample(name, options, context);
    REQUIRE(mesh);
    return *mesh;
}

/// Six times the volume of a polyhedron with its faces fanned from their mean point.
double six_volumes(const HexMesh& mesh, const PolyhedralFaces& faces, std::span<const std::size_t> entries) {
    double sum = 0;
    const Point origin = mesh.positions[faces.vertices[entries[0] / 2][0]];
    for (std::size_t entry : entries) {
        const auto polygon = faces.vertices[entry / 2];
        Point middle(0);
        for (Index v : polygon) middle += mesh.positions[v] / static_cast<double>(polygon.size());
        double part = 0;
        for (std::size_t k = 0; k < polygon.size(); ++k)
            part += glm::dot(middle - origin,
                             glm::cross(mesh.positions[polygon[k]] - origin,
                                        mesh.positions[polygon[(k + 1) % polygon.size()]] - origin));
        sum += entry % 2 == 1 ? -part : part;
    }
    return sum;
}

/// The numbers of an ASCII list file of labels.
std::vector<long> labels_of(const fs::path& path) {
    std::string text = slurp(path);
    text = text.substr(text.find("}\n") + 2);
    std::istringstream in(std::regex_replace(text, std::regex("[()]"), " "));
    std::size_t count = 0;
    in >> count;
    std::vector<long> values;
    for (long value = 0; in >> value;) values.push_back(value);
    CHECK(values.size() == count);
    return values;
}

} // namespace

TEST_CASE("polyhedral faces: cells keep their volume, faces are in upper triangular order") {
    for (const char* name : {"grid", "octree-corner", "octree-sphere", "octree-trimmed", "octree-halved"}) {
        INFO(name);
        const HexMesh mesh = sample(name);
        const Topology topology = compute_topology(mesh, Parallel(2));
        const auto faces = compute_polyhedral_faces(mesh, topology, Parallel(2));
        INFO((faces ? "" : faces.error().one_line()));
        REQUIRE(faces);
        bool ordered = true;
        for (std::size_t f = 0; f < faces->internal_count(); ++f) {
            ordered = ordered && faces->owner[f] < faces->neighbour[f];
            if (f > 0)
                ordered = ordered && std::pair(faces->owner[f - 1], faces->neighbour[f - 1]) <
                                         std::pair(faces->owner[f], faces->neighbour[f]);
        }
        CHECK(ordered);
        // Euler: V - E + F - C = 0 for a ball of polyhedra, plus 1 for its outside.
        std::set<std::pair<Index, Index>> edges;
        for (std::size_t f = 0; f < faces->count(); ++f) {
            const auto polygon = faces->vertices[f];
            for (std::size_t k = 0; k < polygon.size(); ++k)
                edges.insert(std::minmax(polygon[k], polygon[(k + 1) % polygon.size()]));
        }
        const auto signed_count = [](std::size_t n) { return static_cast<long>(n); };
        CHECK(signed_count(mesh.vertex_count()) - signed_count(edges.size()) + signed_count(faces->count()) -
                  signed_count(mesh.cell_count()) ==
              1);
        if (std::string(name) == "octree-halved") continue; // warped: its faces are not plane
        const Csr<std::size_t> cell_face = faces_of_cells(*faces, mesh.cell_count());
        double worst = 0;
        for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
            const Cell& cell = mesh.cells[c];
            const auto side = [&](int k) {
                return glm::distance(mesh.positions[cell[0]], mesh.positions[cell[k]]);
            };
            const double box = side(1) * side(3) * side(4);
            worst = std::max(worst, std::abs(six_volumes(mesh, *faces, cell_face[c]) / 6 - box) / box);
        }
        CHECK(worst < 1e-9);
    }
}

TEST_CASE("polyhedral faces: two vertices with the same constraint leave cells open, which is said") {
    const HexMesh whole = sample("octree-corner");
    std::size_t refused = 0;
    for (std::size_t row = 0; row < whole.hanging.count(); ++row) {
        HexMesh mesh = whole;
        const Index first = mesh.hanging.vertex[row], twin = static_cast<Index>(mesh.vertex_count());
        const std::size_t begin = mesh.hanging.offset[row], end = mesh.hanging.offset[row + 1];
        if (end - begin != 2) continue; // only on edges
        const std::array<Index, 2> masters = {mesh.hanging.master[begin], mesh.hanging.master[begin + 1]};
        const std::array<double, 2> weights = {mesh.hanging.weight[begin], mesh.hanging.weight[begin + 1]};
        mesh.positions.push_back(mesh.positions[first]);
        append_row(mesh.hanging, twin, masters, weights);
        for (Cell& cell : mesh.cells) std::replace(cell.begin(), cell.end(), first, twin);
        const auto faces = compute_polyhedral_faces(mesh, compute_topology(mesh, Parallel(1)), Parallel(1));
        if (faces) continue; // both large faces at the edge are split: nothing asks for its middle
        ++refused;
        CHECK(faces.error().code == ErrorCode::bad_input);
        CHECK(faces.error().where.starts_with("cell "));
    }
    CHECK(refused > 0);
}

TEST_CASE("polyMesh: patches by name, levels, the same bytes for any number of threads") {
    const test::Scratch scratch;
    HexMesh mesh = sample("octree-corner");
    const Topology topology = compute_topology(mesh, Parallel(1));
    mesh.patch_names = {"in let;1", "9walls", "in let 1"};
    for (CellFace face : topology.boundary_faces) {
        const Quad quad = face_vertices(mesh, face);
        const auto lies_at = [&](int axis, double value) {
            return std::all_of(quad.begin(), quad.end(),
                               [&](Index v) { return mesh.positions[v][axis] == value; });
        };
        if (lies_at(0, 0)) mesh.boundary.push_back({quad, 0});
        if (lies_at(1, 0)) mesh.boundary.push_back({quad, 1});
        if (lies_at(2, 0)) mesh.boundary.push_back({quad, 2});
    }
    Context one(1), three(3);
    WriteOptions options;
    options.encoding = Encoding::text;
    const fs::path a = scratch / "a" / "polyMesh", b = scratch / "b" / "polyMesh";
    for (const fs::path& folder : {a, b}) fs::create_directories(folder.parent_path());
    REQUIRE(write_mesh(a, mesh, {}, options, one));
    REQUIRE(write_mesh(b, mesh, {}, options, three));
    for (const char* name :
         {"points", "faces", "owner", "neighbour", "boundary", "cellLevel", "pointLevel"}) {
        INFO(name);
        CHECK(slurp(a / name) == slurp(b / name));
    }
    const std::string boundary = slurp(a / "boundary");
    for (const char* word : {"in_let_1\n", "_9walls\n", "in_let_1_2\n", "    boundary\n"})
        CHECK(boundary.find(word) != std::string::npos);
    const auto cell_level = labels_of(a / "cellLevel"), point_level = labels_of(a / "pointLevel");
    CHECK(cell_level == std::vector<long>(mesh.level.begin(), mesh.level.end()));
    // What OpenFOAM's refinement engine relies on: just 8 points of a cell are at or below its level.
    const auto faces = compute_polyhedral_faces(mesh, topology, Parallel(1));
    REQUIRE(faces);
    const Csr<std::size_t> cell_face = faces_of_cells(*faces, mesh.cell_count());
    std::size_t wrong = 0;
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
        std::set<Index> anchors;
        for (std::size_t entry : cell_face[c])
            for (Index v : faces->vertices[entry / 2])
                if (point_level[v] <= cell_level[c]) anchors.insert(v);
        wrong += anchors.size() != 8;
    }
    CHECK(wrong == 0);
}

TEST_CASE("polyMesh: replaces an earlier one as a whole, and nothing else") {
    const test::Scratch scratch;
    Context context(1);
    HexMesh mesh = sample("grid", {2});
    const fs::path folder = scratch / "constant" / "polyMesh";
    fs::create_directories(folder / "sets");
    test::spill(folder / "points", "earlier");
    test::spill(folder / "cellZones", "earlier");

    test::spill(folder / "notes.txt", "mine");
    const Status refused = write_openfoam(folder, mesh, Encoding::automatic, {}, context);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().one_line().find("notes.txt") != std::string::npos);
    CHECK(slurp(folder / "points") == "earlier");
    fs::remove(folder / "notes.txt");

    mesh.level.clear();
    HexMesh broken = mesh;
    broken.positions[3].x = std::nan("");
    CHECK_FALSE(write_mesh(folder, broken, {}, {}, context));
    CHECK(slurp(folder / "points") == "earlier");

    REQUIRE(write_mesh(scratch / "case.foam", mesh, {}, {}, context));
    CHECK(fs::exists(scratch / "case.foam"));
    CHECK(slurp(folder / "points").find("binary") != std::string::npos);
    CHECK_FALSE(fs::exists(folder / "cellZones"));
    CHECK_FALSE(fs::exists(folder / "cellLevel"));
    CHECK(std::distance(fs::directory_iterator(folder), {}) == 5);
    CHECK(std::distance(fs::directory_iterator(folder.parent_path()), {}) == 1);
}

TEST_CASE("VTU with polyhedra: VTK reads hexahedra and closed polyhedra of the same volume") {
    const test::Scratch scratch;
    Context context(2);
    const HexMesh mesh = sample("octree-sphere");
    WriteOptions options;
    options.polyhedra = true;
    const fs::path file = scratch / "polyhedra.vtu";
    REQUIRE(write_mesh(file, mesh, {}, options, context));
    vtkNew<vtkXMLUnstructuredGridReader> reader;
    reader->SetFileName(file.c_str());
    reader->Update();
    vtkUnstructuredGrid* grid = reader->GetOutput();
    REQUIRE(grid->GetNumberOfCells() == static_cast<vtkIdType>(mesh.cell_count()));
    REQUIRE(grid->GetNumberOfPoints() == static_cast<vtkIdType>(mesh.vertex_count()));
    vtkIdType polyhedra = 0, wrong = 0;
    for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
        auto* cell = dynamic_cast<vtkPolyhedron*>(grid->GetCell(c));
        if (!cell) continue;
        ++polyhedra;
        // Every edge of a closed polyhedron belongs to two of its faces.
        vtkIdType corners = 0;
        for (int f = 0; f < cell->GetNumberOfFaces(); ++f) corners += cell->GetFace(f)->GetNumberOfPoints();
        wrong += corners != 2 * cell->GetNumberOfEdges();
        wrong += cell->GetNumberOfPoints() - cell->GetNumberOfEdges() + cell->GetNumberOfFaces() != 2;
        wrong += !cell->IsConvex() && cell->GetNumberOfFaces() == 6;
    }
    CHECK(polyhedra > 100);
    CHECK(wrong == 0);
    CHECK_FALSE(write_mesh(scratch / "polyhedra.vtk", mesh, {}, options, context));
}
