#include "io/mesh_io.hpp"
#include "io/scratch.hpp"

#include <algorithm>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

const fs::path kData = HEXOPT_IO_DATA;

/// Cells as positions, so that files with other node numbers compare.
std::vector<std::vector<double>> corner_positions(const HexMesh& mesh) {
    std::vector<std::vector<double>> cells;
    for (const Cell& cell : mesh.cells) {
        cells.emplace_back();
        for (Index v : cell)
            for (int k = 0; k < 3; ++k) cells.back().push_back(std::round(mesh.positions[v][k] * 1e6) * 1e-6);
    }
    std::sort(cells.begin(), cells.end());
    return cells;
}

Result<MeshFile> read_text(const std::string& text) {
    const test::Scratch scratch;
    test::spill(scratch / "mesh", text);
    Context context(1);
    return read_mesh_file(scratch / "mesh", context);
}

} // namespace

// The files are Gmsh 4.8.4's from box.geo: a box of 2 x 1 x 1.5 in 2 x 1 x 2 cells.
TEST_CASE("files of Gmsh are read, text and binary, with the names of their groups") {
    std::vector<std::vector<double>> expected;
    for (const char* name : {"v22_text", "v22_binary", "v41_text", "v41_binary", "v22_two_groups",
                             "v41_two_groups", "v41_parametric_text", "v41_parametric_binary"}) {
        Context context(1);
        const auto file = read_mesh_file(kData / (std::string(name) + ".msh"), context);
        INFO(name);
        INFO((file ? "" : file.error().one_line()));
        REQUIRE(file);
        const HexMesh& mesh = file->mesh;
        CHECK(mesh.vertex_count() == 18);
        CHECK(mesh.cell_count() == 4);
        if (expected.empty()) expected = corner_positions(mesh);
        CHECK(corner_positions(mesh) == expected);
        CHECK(mesh.boundary.size() == 4);
        CHECK(mesh.patch_names == std::vector<std::string>{"bottom face", "top"});
        for (const BoundaryQuad& quad : mesh.boundary)
            for (Index v : quad.vertices) CHECK(mesh.positions[v].z == (quad.patch == 0 ? 0.0 : 1.5));
        REQUIRE(file->fields.size() == 1);
        CHECK(file->fields[0].name == "gmsh:physical");
        CHECK(file->fields[0].values == std::vector<double>(4, 11.0));
    }
}

TEST_CASE("without groups, Gmsh's surfaces are the patches") {
    for (const char* name : {"v22_all.msh", "v41_all.msh"}) {
        Context context(1);
        const auto mesh = read_mesh(kData / name, context);
        INFO(name);
        REQUIRE(mesh);
        CHECK(mesh->boundary.size() == 16);
        const bool has_groups = std::string(name) == "v41_all.msh"; // version 2 leaves them out here
        CHECK(mesh->patch_names == std::vector<std::string>{has_groups ? "bottom face" : "surface_1",
                                                            "surface_13", "surface_17", "surface_21",
                                                            "surface_25", has_groups ? "top" : "surface_26"});
    }
}

TEST_CASE("Gmsh's MEDIT and VTK files are read") {
    Context context(1);
    const auto reference = read_mesh(kData / "v22_text.msh", context);
    REQUIRE(reference);
    for (const char* name : {"gmsh.mesh", "gmsh_text.vtk", "gmsh_binary.vtk"}) {
        const auto mesh = read_mesh(kData / name, context);
        INFO(name << (mesh ? "" : mesh.error().one_line()));
        REQUIRE(mesh);
        CHECK(corner_positions(*mesh) == corner_positions(*reference));
        CHECK(mesh->boundary.size() >= 4);
    }
}

TEST_CASE("Gmsh files that are wrong are refused with place and advice") {
    const std::string text2 = test::slurp(kData / "v22_text.msh"),
                      text4 = test::slurp(kData / "v41_text.msh");
    const auto refused = [](std::string text, const std::string& from, const std::string& to,
                            const std::string& part) {
        REQUIRE(text.find(from) != std::string::npos);
        const auto result = read_text(text.replace(text.find(from), from.size(), to));
        REQUIRE_FALSE(result);
        INFO(result.error().one_line());
        CHECK(result.error().code == ErrorCode::bad_input);
        CHECK(result.error().reasons.size() == 2);
        CHECK(result.error().one_line().find(part) != std::string::npos);
    };
    refused(text2, "2.2 0 8", "4 0 8", "save it as version 4.1 or 2.2");
    refused(text2, "$Nodes\n18", "$Nodes\n4000000000", "mesh:12: announces 4000000000 nodes");
    refused(text2, "\n3 2 1 0\n", "\n2 2 1 0\n", "node 2 stands twice");
    refused(text2, "\n3 2 1 0\n", "\n3 2 1 nan\n", "node 3");
    refused(text2, "7 5 2 11 1 1 9", "7 5 2 11 1 1 99", "uses node 99");
    refused(text2, "7 5 2 11 1 1 9", "7 5 2 11 1 9 9", "twice");
    refused(text2, "7 5 2 11 1 1 9", "7 555 2 11 1 1 9", "type 555");
    refused(text2, "$EndElements", "", "$EndElements");
    refused(text4, "3 1 5 4\n7", "3 1 5 4000000\n7", "announces 4000000 elements");
    refused(text4, "4 10 1 10", "4 11 1 10", "10 elements where 11");
    refused(text4, "3 1 5 4\n7 1 9 10 4 13 17 18 16", "3 1 6 4\n7 1 9 10 4 13 17 18 16", "mesh:");
}

TEST_CASE("cells that are no hexahedra are counted by type") {
    const auto mixed =
        read_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n"
                  "5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n$EndNodes\n$Elements\n4\n1 5 0 1 2 3 4 5 6 7 8\n"
                  "2 4 0 1 2 3 5\n3 4 0 1 2 3 6\n4 7 0 1 2 3 4 5\n$EndElements\n");
    REQUIRE_FALSE(mixed);
    CHECK(mixed.error().one_line().find("1 pyramid, 2 tetrahedra") != std::string::npos);
}
