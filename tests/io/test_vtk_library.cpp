#include "io/mesh_io.hpp"
#include "io/sample_meshes.hpp"
#include "io/scratch.hpp"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkErrorCode.h>
#include <vtkFieldData.h>
#include <vtkIdTypeArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkUnstructuredGridReader.h>
#include <vtkUnstructuredGridWriter.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

template <class Reader>
void check_read_by_vtk(const fs::path& path, const MeshFile& file) {
    INFO(path);
    vtkNew<Reader> reader;
    reader->SetFileName(path.c_str());
    reader->Update();
    CHECK(reader->GetErrorCode() == vtkErrorCode::NoError);
    vtkUnstructuredGrid* grid = reader->GetOutput();
    const HexMesh& mesh = file.mesh;
    REQUIRE(grid->GetNumberOfPoints() == static_cast<vtkIdType>(mesh.vertex_count()));
    REQUIRE(grid->GetNumberOfCells() == static_cast<vtkIdType>(mesh.cell_count()));
    bool same = true;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        double p[3];
        grid->GetPoint(static_cast<vtkIdType>(v), p);
        for (int k = 0; k < 3; ++k) same = same && test::same_bits(p[k], mesh.positions[v][k]);
    }
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
        vtkIdType size = 0;
        const vtkIdType* ids = nullptr;
        grid->GetCellPoints(static_cast<vtkIdType>(c), size, ids);
        REQUIRE(size == 8);
        CHECK(grid->GetCellType(static_cast<vtkIdType>(c)) == VTK_HEXAHEDRON);
        for (int k = 0; k < 8; ++k) same = same && ids[k] == mesh.cells[c][k];
    }
    CHECK(same);
    for (const FieldData& field : file.fields) {
        vtkDataArray* array =
            field.location == FieldLocation::point
                ? grid->GetPointData()->GetArray(field.name.c_str())
                : static_cast<vtkDataArray*>(grid->GetCellData()->GetArray(field.name.c_str()));
        INFO(field.name);
        REQUIRE(array != nullptr);
        REQUIRE(array->GetNumberOfValues() == static_cast<vtkIdType>(field.values.size()));
        CHECK(array->GetNumberOfComponents() == static_cast<int>(field.components));
        for (std::size_t i = 0; i < field.values.size(); ++i)
            same = same && array->GetComponent(static_cast<vtkIdType>(i / field.components),
                                               static_cast<int>(i % field.components)) == field.values[i];
        CHECK(same);
    }
    if (mesh.level.empty()) return;
    REQUIRE(grid->GetCellData()->GetArray("level") != nullptr);
    CHECK(grid->GetCellData()->GetArray("level")->GetTuple1(0) == mesh.level[0]);
}

template <class Reader>
void check_constraints_by_vtk(const fs::path& path, const HexMesh& mesh) {
    vtkNew<Reader> reader;
    reader->SetFileName(path.c_str());
    reader->Update();
    vtkFieldData* fields = reader->GetOutput()->GetFieldData();
    REQUIRE(fields->GetArray("hexopt_hanging_weight") != nullptr);
    CHECK(fields->GetArray("hexopt_hanging_master")->GetNumberOfTuples() ==
          static_cast<vtkIdType>(mesh.hanging.master.size()));
    for (std::size_t i = 0; i < mesh.hanging.vertex.size(); ++i)
        CHECK(fields->GetArray("hexopt_hanging_vertex")->GetTuple1(static_cast<vtkIdType>(i)) ==
              mesh.hanging.vertex[i]);
    auto* names = vtkStringArray::SafeDownCast(fields->GetAbstractArray("hexopt_patch_name"));
    REQUIRE(names != nullptr);
    REQUIRE(names->GetNumberOfValues() == static_cast<vtkIdType>(mesh.patch_names.size()));
    for (std::size_t p = 0; p < mesh.patch_names.size(); ++p)
        CHECK(names->GetValue(static_cast<vtkIdType>(p)) == mesh.patch_names[p]);
}

/// The block of sample_block() with its arrays, hexahedra first, then two quads of the boundary, a line and a
/// vertex.
vtkSmartPointer<vtkUnstructuredGrid> make_grid(const MeshFile& file, bool only_hexahedra) {
    auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (const Point& p : file.mesh.positions) points->InsertNextPoint(p.x, p.y, p.z);
    grid->SetPoints(points);
    const auto add = [&](int type, auto... ids) {
        const vtkIdType list[] = {static_cast<vtkIdType>(ids)...};
        grid->InsertNextCell(type, sizeof...(ids), list);
    };
    for (const Cell& c : file.mesh.cells) add(VTK_HEXAHEDRON, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]);
    std::size_t others = 0;
    if (!only_hexahedra) {
        for (int q = 0; q < 2; ++q) {
            const Quad& v = file.mesh.boundary[static_cast<std::size_t>(q)].vertices;
            add(VTK_QUAD, v[0], v[3], v[2], v[1]); // seen from inside
        }
        add(VTK_LINE, 0, 1);
        add(VTK_VERTEX, 0);
        others = 4;
    }
    vtkNew<vtkIntArray> tag;
    tag->SetName("patch");
    vtkNew<vtkDoubleArray> value;
    value->SetName("a value");
    value->SetComponentName(0, "component");
    for (std::size_t c = 0; c < file.mesh.cell_count() + others; ++c) {
        tag->InsertNextValue(static_cast<int>(c % 2 == 0 ? 40 : 30));
        value->InsertNextValue(0.125 * static_cast<double>(c));
    }
    grid->GetCellData()->AddArray(tag);
    grid->GetCellData()->SetScalars(value);
    vtkNew<vtkDoubleArray> velocity;
    velocity->SetName("velocity");
    velocity->SetNumberOfComponents(3);
    for (std::size_t v = 0; v < file.mesh.vertex_count(); ++v) {
        const double x = static_cast<double>(v) / 4;
        velocity->InsertNextTuple3(x, -x, 1e-310);
    }
    grid->GetPointData()->SetVectors(velocity);
    vtkNew<vtkIdTypeArray> ids;
    ids->SetName("global ids");
    for (std::size_t v = 0; v < file.mesh.vertex_count(); ++v)
        ids->InsertNextValue(static_cast<vtkIdType>(v) + 100);
    grid->GetPointData()->SetGlobalIds(ids);
    vtkNew<vtkStringArray> note;
    note->SetName("note");
    note->InsertNextValue("some text, 100%");
    grid->GetFieldData()->AddArray(note);
    return grid;
}

/// VTK writes 11 digits in legacy files.
void round_positions(HexMesh& mesh) {
    for (Point& p : mesh.positions)
        for (int k = 0; k < 3; ++k) p[k] = std::abs(p[k]) > 1e3 ? 1e3 : std::floor(p[k] * 64) / 64 + 0.0;
}

void check_read_from_vtk(const fs::path& path, const MeshFile& file, bool only_hexahedra) {
    INFO(path.filename());
    Context context(1);
    const Result<MeshFile> back = read_mesh_file(path, context);
    INFO((back ? "" : back.error().one_line()));
    REQUIRE(back);
    HexMesh expected = file.mesh;
    expected.level.clear();
    if (only_hexahedra) {
        expected.boundary.clear();
        expected.patch_names.clear();
    } else {
        expected.boundary.resize(2);
        // Quads follow the hexahedra, so with an even number of these the first has tag 40, the second 30.
        const bool even = file.mesh.cell_count() % 2 == 0;
        expected.patch_names = {"patch_30", "patch_40"};
        expected.boundary[0].patch = even ? 1 : 0;
        expected.boundary[1].patch = even ? 0 : 1;
        for (std::size_t q = 0; q < 2; ++q) {
            const Quad v = file.mesh.boundary[q].vertices;
            expected.boundary[q].vertices = v;
        }
    }
    test::check_same(expected, back->mesh);
    const auto find = [&](const std::string& name) {
        const auto found = std::find_if(back->fields.begin(), back->fields.end(),
                                        [&](const auto& f) { return f.name == name; });
        REQUIRE(found != back->fields.end());
        return *found;
    };
    const FieldData value = find("a value");
    REQUIRE(value.values.size() == file.mesh.cell_count());
    for (std::size_t c = 0; c < value.values.size(); ++c)
        CHECK(value.values[c] == 0.125 * static_cast<double>(c));
    const FieldData velocity = find("velocity");
    CHECK(velocity.components == 3);
    CHECK(velocity.location == FieldLocation::point);
    CHECK(velocity.values[4] == -0.25);
    CHECK(velocity.values[5] == 1e-310);
    CHECK(find("global ids").values[1] == 101);
    CHECK(find("patch").type == FieldType::int32);
}

} // namespace

TEST_CASE("VTK reads what is written") {
    const test::Scratch scratch;
    Context context(1);
    for (int size : {1, 30}) {
        const MeshFile file = test::sample_block(size, 3, size);
        for (Encoding encoding : {Encoding::binary, Encoding::text}) {
            MeshFile finite = file;
            finite.fields[2].values[0] = -0.25; // VTK's ASCII reader stops at inf
            REQUIRE(write_mesh(scratch / "a.vtk", finite.mesh, finite.fields, {MeshFormat::vtk, encoding, 3},
                               context));
            check_read_by_vtk<vtkUnstructuredGridReader>(scratch / "a.vtk", finite);
        }
        REQUIRE(write_mesh(scratch / "a.vtu", file.mesh, file.fields, {}, context));
        check_read_by_vtk<vtkXMLUnstructuredGridReader>(scratch / "a.vtu", file);
    }
}

TEST_CASE("VTK reads hanging constraints and patch names") {
    const test::Scratch scratch;
    Context context(1);
    const HexMesh mesh = test::sample_hanging();
    for (Encoding encoding : {Encoding::binary, Encoding::text}) {
        REQUIRE(write_mesh(scratch / "a.vtk", mesh, {}, {MeshFormat::vtk, encoding, 3}, context));
        check_read_by_vtk<vtkUnstructuredGridReader>(scratch / "a.vtk", {mesh, {}});
        check_constraints_by_vtk<vtkUnstructuredGridReader>(scratch / "a.vtk", mesh);
    }
    REQUIRE(write_mesh(scratch / "a.vtu", mesh, {}, {}, context));
    check_read_by_vtk<vtkXMLUnstructuredGridReader>(scratch / "a.vtu", {mesh, {}});
    check_constraints_by_vtk<vtkXMLUnstructuredGridReader>(scratch / "a.vtu", mesh);
}

TEST_CASE("legacy files of VTK are read, ASCII and binary, layouts of versions 4 and 5") {
    const test::Scratch scratch;
    for (int size : {1, 12})
        for (bool only_hexahedra : {true, false})
            for (int type : {VTK_ASCII, VTK_BINARY})
                for (int version : {vtkUnstructuredGridWriter::VTK_LEGACY_READER_VERSION_4_2,
                                    vtkUnstructuredGridWriter::VTK_LEGACY_READER_VERSION_5_1}) {
                    MeshFile file = test::sample_block(size, 1, 2);
                    if (type == VTK_ASCII) round_positions(file.mesh);
                    const auto grid = make_grid(file, only_hexahedra);
                    vtkNew<vtkUnstructuredGridWriter> writer;
                    const fs::path path = scratch / fmt::format("a{}{}.vtk", type, version);
                    writer->SetFileName(path.c_str());
                    writer->SetFileType(type);
                    writer->SetFileVersion(version);
                    writer->SetInputData(grid);
                    REQUIRE(writer->Write() == 1);
                    check_read_from_vtk(path, file, only_hexahedra);
                }
}

TEST_CASE("VTU files of VTK are read in every encoding") {
    const test::Scratch scratch;
    using Writer = vtkXMLUnstructuredGridWriter;
    int number = 0;
    for (int size : {1, 25})
        for (bool only_hexahedra : {true, false})
            for (int mode : {Writer::Ascii, Writer::Binary, Writer::Appended})
                for (int compressor : {Writer::NONE, Writer::ZLIB, Writer::LZ4, Writer::LZMA})
                    for (bool raw : {true, false})
                        for (int header : {Writer::UInt32, Writer::UInt64})
                            for (int order : {Writer::LittleEndian, Writer::BigEndian}) {
                                if (size > 1 && compressor == Writer::LZMA && header == Writer::UInt32)
                                    continue;
                                MeshFile file = test::sample_block(size, 2, size);
                                if (mode == Writer::Ascii) file.mesh.positions[0].x = 0; // VTK writes -0 as 0
                                vtkNew<Writer> writer;
                                const fs::path path = scratch / fmt::format("a{}.vtu", number++);
                                writer->SetFileName(path.c_str());
                                writer->SetDataMode(mode);
                                writer->SetCompressorType(compressor);
                                writer->SetEncodeAppendedData(!raw);
                                writer->SetHeaderType(header);
                                writer->SetByteOrder(order);
                                writer->SetInputData(make_grid(file, only_hexahedra));
                                REQUIRE(writer->Write() == 1);
                                INFO("mode " << mode << " compressor " << compressor << " raw " << raw
                                             << " header " << header << " order " << order);
                                check_read_from_vtk(path, file, only_hexahedra);
                                fs::remove(path);
                            }
}
