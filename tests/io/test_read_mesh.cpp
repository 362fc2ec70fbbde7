#include "io/mesh_io.hpp"
#include "io/scratch.hpp"

using namespace hexopt;

namespace {

const std::string kVtk = R"(# vtk DataFile Version 3.0
a title
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 8 float
0 0 0  1 0 0  1 1 0  0 1 0
0 0 1  1 0 1  1 1 1  0 1 1
CELLS 2 14
8 0 1 2 3 4 5 6 7
4 0 3 2 1
CELL_TYPES 2
12
9
)";

const std::string kMedit = R"(MeshVersionFormatted 2
# comment
Dimension
3
Vertices
8
0 0 0 1
1 0 0 1
1 1 0 1
0 1 0 1
0 0 1 1
1 0 1 1
1 1 1 1
0 1 1 1
Corners
2
1
2
Normals
1
0 0 1e0
Hexahedra
1
1 2 3 4 5 6 7 8 5
Quadrilaterals
2
1 2 6 5 9
1 2 3 4 -2
Triangles
1
1 2 3 0
End
)";

/// A row of two cells, cut into two pieces that share four points.
const std::string kPieces = R"(<?xml version="1.0"?>
<!-- <VTKFile> in a comment -->
<VTKFile type='UnstructuredGrid' version="0.1" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="8" NumberOfCells="1"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity">0 1 2 3 4 5 6 7</DataArray><DataArray type="Int32" Name="offsets">8</DataArray>
<DataArray type="UInt8" Name="types">12</DataArray></Cells>
<PointData><DataArray type="Float64" Name="x &amp; y">0 1 2 3 4 5 6 7</DataArray></PointData>
<CellData><DataArray type="Int8" Name="only here">1</DataArray><DataArray type="Int8" Name="both">1</DataArray></CellData></Piece>
<Piece NumberOfPoints="8" NumberOfCells="1"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
1 0 0 2 0 0 2 1 0 1 1 0 1 0 1 2 0 1 2 1 1 1 1 1</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity">0 1 2 3 4 5 6 7</DataArray><DataArray type="Int32" Name="offsets">8</DataArray>
<DataArray type="UInt8" Name="types">12</DataArray></Cells>
<PointData><DataArray type="Float64" Name="x &amp; y">1 8 9 2 5 10 11 6</DataArray></PointData>
<CellData><DataArray type="Int8" Name="both">2</DataArray></CellData></Piece>
</UnstructuredGrid></VTKFile>
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
    REQUIRE(text.find(from) != std::string::npos);
    return text.replace(text.find(from), from.size(), to);
}

struct Reading {
    Result<MeshFile> file;
    std::string warnings;
};

Reading read_text(const std::string& text) {
    const test::Scratch scratch;
    test::spill(scratch / "mesh", text);
    Context context(1);
    std::string warnings;
    context.set_log_sink([&](LogLevel level, std::string_view line) {
        if (level >= LogLevel::warning) warnings += std::string(line) + "\n";
    });
    auto file = read_mesh_file(scratch / "mesh", context);
    return {std::move(file), warnings};
}

void check_refused(const std::string& text, const std::string& part, const std::string& advice) {
    const Reading reading = read_text(text);
    INFO(part);
    REQUIRE_FALSE(reading.file);
    const Error& error = reading.file.error();
    INFO(error.one_line());
    CHECK(error.code == ErrorCode::bad_input);
    CHECK(error.one_line().find(part) != std::string::npos);
    CHECK(error.one_line().find(advice) != std::string::npos);
}

} // namespace

TEST_CASE("boundary quadrilaterals become patches, seen from outside") {
    const Reading vtk = read_text(kVtk);
    REQUIRE(vtk.file);
    CHECK(vtk.file->mesh.boundary.size() == 1);
    CHECK(vtk.file->mesh.boundary[0].vertices == Quad{0, 3, 2, 1});
    const Reading medit = read_text(kMedit);
    REQUIRE(medit.file);
    const HexMesh& mesh = medit.file->mesh;
    CHECK(mesh.patch_names == std::vector<std::string>{"patch_-2", "patch_9"});
    REQUIRE(mesh.boundary.size() == 2);
    CHECK(mesh.boundary[0].vertices == Quad{0, 1, 5, 4});
    CHECK(mesh.boundary[0].patch == 1);
    CHECK(mesh.boundary[1].vertices == Quad{0, 3, 2, 1}); // the file lists it seen from inside
    CHECK(medit.warnings.find("1 triangle") != std::string::npos);
    CHECK(medit.warnings.find("Normals") != std::string::npos);
    REQUIRE(medit.file->fields.size() == 2);
    CHECK(medit.file->fields[0].values == std::vector<double>(8, 1));
    CHECK(medit.file->fields[1].values == std::vector<double>{5});
}

TEST_CASE("text positions keep all digits even under the heading float") {
    const Reading reading = read_text(with(kVtk, "1 1 0  0", "1 1.2345678901234567 0  0"));
    REQUIRE(reading.file);
    CHECK(reading.file->mesh.positions[2].y == 1.2345678901234567);
}

TEST_CASE("pieces of a VTU file are joined where they meet") {
    const Reading reading = read_text(kPieces);
    INFO((reading.file ? "" : reading.file.error().one_line()));
    REQUIRE(reading.file);
    const HexMesh& mesh = reading.file->mesh;
    CHECK(mesh.vertex_count() == 12);
    CHECK(mesh.cells == std::vector<Cell>{{0, 1, 2, 3, 4, 5, 6, 7}, {1, 8, 9, 2, 5, 10, 11, 6}});
    REQUIRE(reading.file->fields.size() == 2);
    CHECK(reading.file->fields[0].name == "x & y");
    CHECK(reading.file->fields[0].values == std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
    CHECK(reading.file->fields[1].values == std::vector<double>{1, 2});
    CHECK(reading.warnings.find("only here") != std::string::npos);
}

TEST_CASE("arrays under reserved names are left out with a warning") {
    const Reading vtk = read_text(
        kVtk + "CELL_DATA 2\nSCALARS hexopt_q int\nLOOKUP_TABLE default\n1 2\nSCALARS q int 1\n3 4\n");
    INFO((vtk.file ? "" : vtk.file.error().one_line()));
    REQUIRE(vtk.file);
    REQUIRE(vtk.file->fields.size() == 1);
    CHECK(vtk.file->fields[0].values == std::vector<double>{3});
    CHECK(vtk.warnings.find("hexopt_q") != std::string::npos);
}

TEST_CASE("errors name the line and say what to do") {
    check_refused(with(kVtk, "8 0 1 2 3 4 5 6 7", "8 0 1 2 3 4 5 6 8"), "mesh:9: hexahedron 0 uses vertex 8",
                  "may count from 1");
    check_refused(with(kVtk, "8 0 1 2 3 4 5 6 7", "8 0 1 2 3 4 5 6 999999"),
                  "mesh:9: ", "write or copy it again");
    check_refused(with(kVtk, "8 0 1 2 3 4 5 6 7", "8 0 1 2 3 4 5 6 -1"), "mesh:9: vertex id -1", "damaged");
    check_refused(with(kVtk, "8 0 1 2 3 4 5 6 7", "8 0 1 2 3 4 5 6 6"),
                  "mesh:9: hexahedron 0 uses vertex 6 twice", "collapsed");
    check_refused(with(kVtk, "0 0 1  1", "0 nan 1  1"), "mesh:7: vertex 4 has y coordinate nan", "finite");
    check_refused(with(kVtk, "POINTS 8", "POINTS 4294967295"), "mesh:5: announces 4294967295 points",
                  "cut short");
    check_refused(with(kVtk, "POINTS 8", "POINTS 9"), "mesh:8: 'CELLS' stands where a number should",
                  "damaged");
    check_refused(with(kVtk, "CELLS 2 14", "CELLS 2 13"), "mesh:", "damaged");
    check_refused(with(kVtk, "\n12\n", "\n10\n"), "1 tetrahedron", "convert");
    check_refused(with(kVtk, "\n12\n", "\n77\n"), "1 cell of VTK type 77", "convert");
    check_refused(with(kVtk, "UNSTRUCTURED_GRID", "POLYDATA"), "mesh:4: ", "UNSTRUCTURED_GRID");
    check_refused(kVtk.substr(0, kVtk.find("CELL_TYPES")), "ends without CELL_TYPES", "cut short");
    check_refused(with(kMedit, "1 2 3 4 5 6 7 8 5", "0 1 2 3 4 5 6 7 5"), "mesh:24: vertex id 0",
                  "count from 0");
    check_refused(with(kMedit, "1 2 3 4 5 6 7 8 5", "1 2 3 4 5 6 7 9 5"),
                  "mesh:24: hexahedron 1 uses vertex 9", "damaged");
    check_refused(with(kMedit, "1 0 0 1", "1 inf 0 1"), "mesh:8: vertex 2 has y coordinate inf", "finite");
    check_refused(with(kMedit, "Dimension\n3", "Dimension\n2"), "mesh:4: dimension 2", "three dimensions");
    check_refused(with(kMedit, "Hexahedra\n1", "Hexahedra\n99999999"),
                  "mesh:23: announces 99999999 hexahedra", "cut short");
    check_refused(with(kMedit, "Triangles\n1\n1 2 3 0", "Tetrahedra\n1\n1 2 3 5 0"), "1 tetrahedron",
                  "convert");
    check_refused(with(kPieces, "types\">12", "types\">14"), "1 pyramid", "convert");
    check_refused(with(kPieces, ">0 1 2 3 4 5 6 7</DataArray><DataArray type=\"Int32\" Name=\"offsets\"",
                       ">0 1 2 3 4 5 6 8</DataArray><DataArray type=\"Int32\" Name=\"offsets\""),
                  "mesh:6: array connectivity: value 8", "damaged");
    check_refused(with(kPieces, "0 0 1 1 0 1", "0 0 1 1 0 x"), "mesh:5: 'x'", "damaged");
    check_refused(with(kPieces, "<!-- <VTKFile> in a comment -->", "<!DOCTYPE a [<!ENTITY b \"c\">]>"),
                  "mesh:2: a declaration", "remove");
    check_refused(std::string("\1\0\0\0\2\0\0\0\3\0\0\0", 12), "binary MEDIT", "convert it to text");
    check_refused("PK\3\4 something", "no mesh format", "legacy VTK");
}

TEST_CASE("what cannot be opened says why") {
    const test::Scratch scratch;
    Context context(1);
    for (const char* name : {"none", ".", "/dev/null"}) {
        const auto mesh = read_mesh(*name == '/' ? std::filesystem::path(name) : scratch / name, context);
        REQUIRE_FALSE(mesh);
        CHECK(mesh.error().code == ErrorCode::bad_input);
        CHECK(mesh.error().reasons.size() == 2);
    }
    test::spill(scratch / "empty", "");
    CHECK(read_mesh(scratch / "empty", context).error().one_line().find("is empty") != std::string::npos);
    test::spill(scratch / "good", kVtk);
    context.cancel();
    CHECK(read_mesh(scratch / "good", context).error().code == ErrorCode::cancelled);
}
