#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "io/surface_samples.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLPolyDataWriter.h>

using namespace hexopt;

namespace {

/// A point, a line, a triangle, a quadrilateral and a strip of three triangles.
vtkNew<vtkPolyData> make_polydata(bool with_patches) {
    vtkNew<vtkPolyData> data;
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (int i = 0; i < 10; ++i) points->InsertNextPoint(0.1 * i, i % 2, 1.0 / (i + 1));
    data->SetPoints(points);
    const auto cells = [](std::initializer_list<std::initializer_list<vtkIdType>> lists) {
        auto array = vtkSmartPointer<vtkCellArray>::New();
        for (const auto& ids : lists) array->InsertNextCell(static_cast<vtkIdType>(ids.size()), ids.begin());
        return array;
    };
    data->SetVerts(cells({{9}}));
    data->SetLines(cells({{8, 9}}));
    data->SetPolys(cells({{0, 1, 2}, {2, 3, 4, 5}}));
    data->SetStrips(cells({{4, 5, 6, 7, 8}}));
    if (with_patches) {
        vtkNew<vtkIntArray> patch;
        patch->SetName("patch");
        for (int value : {0, 0, 7, 3, 7}) patch->InsertNextValue(value);
        data->GetCellData()->AddArray(patch);
    }
    return data;
}

const std::vector<std::array<Index, 3>> kTriangles = {{0, 1, 2}, {2, 3, 4}, {2, 4, 5},
                                                      {4, 5, 6}, {5, 7, 6}, {6, 7, 8}};

} // namespace

TEST_CASE("VTP: what VTK writes is read, in every form") {
    const test::Scratch scratch;
    Context context(1);
    for (int mode : {vtkXMLWriter::Ascii, vtkXMLWriter::Binary, vtkXMLWriter::Appended})
        for (bool compressed : {false, true})
            for (bool with_patches : {false, true}) {
                CAPTURE(mode, compressed, with_patches);
                const vtkNew<vtkPolyData> data = make_polydata(with_patches);
                const std::string file = (scratch / "surface.vtp").string();
                vtkNew<vtkXMLPolyDataWriter> writer;
                writer->SetFileName(file.c_str());
                writer->SetInputData(data);
                writer->SetDataMode(mode);
                if (!compressed) writer->SetCompressorTypeToNone();
                REQUIRE(writer->Write() == 1);
                const auto soup = read_surface(file, context);
                INFO((soup ? "" : soup.error().one_line()));
                REQUIRE(soup);
                CHECK(soup->triangles == kTriangles);
                REQUIRE(soup->vertices.size() == 10);
                for (std::size_t v = 0; v < 10; ++v)
                    for (int k = 0; k < 3; ++k)
                        CHECK(soup->vertices[v][k] ==
                              Approx(data->GetPoint(static_cast<vtkIdType>(v))[k]).epsilon(1e-10));
                using Names = std::vector<std::string>;
                CHECK(soup->patch_names == (with_patches ? Names{"patch_7", "patch_3"} : Names{"surface"}));
                CHECK(soup->patch ==
                      (with_patches ? std::vector<Index>{0, 1, 1, 0, 0, 0} : std::vector<Index>(6)));
            }
}

TEST_CASE("VTP: damaged files and files of other types are refused") {
    const auto refusal = [](std::string text, const std::string& from, const std::string& to) {
        const std::size_t at = text.find(from);
        REQUIRE(at != std::string::npos);
        text.replace(at, from.size(), to);
        const test::Scratch scratch;
        test::spill(scratch / "surface.vtp", text);
        Context context(1);
        const auto soup = read_surface(scratch / "surface.vtp", context);
        REQUIRE_FALSE(soup);
        CHECK(soup.error().code == ErrorCode::bad_input);
        return soup.error().one_line();
    };
    const std::string text = test::kVtp;
    CHECK(refusal(text, "type=\"PolyData\"", "type=\"UnstructuredGrid\"").find("PolyData") !=
          std::string::npos);
    refusal(text, "type=\"PolyData\"", "type=\"PPolyData\"");
    refusal(text, "0 1 2 0 2 3", "0 1 2 0 2 4");
    refusal(text, "0 1 2 0 2 3", "0 1 2 0 2");
    refusal(text, "3 6", "6 3");
    refusal(text, "NumberOfPolys=\"2\"", "NumberOfPolys=\"3\"");
    refusal(text, "NumberOfPolys=\"2\"", "NumberOfPolys=\"99999999999\"");
    refusal(text, "NumberOfPoints=\"4\"", "NumberOfPoints=\"5\"");
    refusal(text, "1 1 0", "1 nan 0");
    refusal(text, "</VTKFile>", "");
}
