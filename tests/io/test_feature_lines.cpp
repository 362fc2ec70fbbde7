#include "io/line_readers.hpp"
#include "io/read_feature_lines.hpp"
#include "scratch.hpp"

#include <catch2/catch.hpp>
#include <random>

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataWriter.h>
#include <vtkXMLPolyDataWriter.h>

using namespace hexopt;
using test::Scratch;
using test::spill;

namespace {

using Segments = std::vector<std::array<Point, 2>>;

// A polyline of three points and one segment apart.
const Segments kExpected = {{Point(0, 0, 0), Point(1, 0, 0.5)},
                            {Point(1, 0, 0.5), Point(1, 1, -2e-3)},
                            {Point(5, 5, 5), Point(6, 5, 5)}};

const char* const kFoam = R"(/*--- C++ ---*\
| =========                 |
\*---------*/
FoamFile
{
    version     2.0;
    format      ascii;
    class       featureEdgeMesh;
    location    "constant/triSurface";
    object      part.eMesh;
}
// points:

5
(
(0 0 0)
(1 0 0.5)
(1 1 -2e-3)
(5 5 5)
(6 5 5)
)

// edges:
3((0 1)(1 2)(3 4))
)";

const char* const kObj =
    "# lines\no part\nv 0 0 0\nv 1 0 0.5\nv 1 1 -2e-3\nl 1/7 2 3 # bent\nv 5 5 5\nv 6 5 5\n"
    "f 1 2 3\nl -2 -1\n";
const char* const kCsv = "x,y,z\n0,0,0\n1, 0, 0.5\n1;1;-2e-3\n\n5,5,5\n6 5 5\n";

Result<FeatureLines> read_text(const std::string& name, const std::string& text) {
    const Context context(1);
    return io_detail::read_feature_lines_bytes(name, text, context);
}

vtkNew<vtkPolyData> make_polydata() {
    vtkNew<vtkPolyData> data;
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (const auto& p :
         {Point(0, 0, 0), Point(1, 0, 0.5), Point(1, 1, -2e-3), Point(5, 5, 5), Point(6, 5, 5)})
        points->InsertNextPoint(p.x, p.y, p.z);
    data->SetPoints(points);
    vtkNew<vtkCellArray> lines, vertices, polygons;
    lines->InsertNextCell({0, 1, 2});
    lines->InsertNextCell({3, 4});
    vertices->InsertNextCell({2});
    polygons->InsertNextCell({0, 1, 3});
    data->SetLines(lines);
    data->SetVerts(vertices);
    data->SetPolys(polygons);
    return data;
}

} // namespace

TEST_CASE("feature lines are read from eMesh, OBJ and CSV files") {
    for (const auto& [name, text] : {std::pair{"a.eMesh", kFoam}, {"a.obj", kObj}, {"a.csv", kCsv}}) {
        INFO(name);
        const auto lines = read_text(name, text);
        INFO((lines ? "" : lines.error().one_line()));
        REQUIRE(lines);
        CHECK(lines->segments == kExpected);
    }
    std::string extended = kFoam;
    extended.replace(extended.find("featureEdgeMesh"), 15, "extendedFeatureEdgeMesh");
    extended += "\n// concaveStart mixedStart nonFeatureStart\n0 0 0\n";
    const auto lines = read_text("a.extendedFeatureEdgeMesh", extended);
    REQUIRE(lines);
    CHECK(lines->segments == kExpected);
}

TEST_CASE("feature lines are read from VTK's files as VTK writes them") {
    const Scratch scratch;
    const auto data = make_polydata();
    Context context(1);
    for (int version : {42, 51})
        for (bool binary : {false, true}) {
            INFO(version << (binary ? " binary" : " text"));
            vtkNew<vtkPolyDataWriter> writer;
            writer->SetInputData(data);
            writer->SetFileVersion(version);
            binary ? writer->SetFileTypeToBinary() : writer->SetFileTypeToASCII();
            writer->SetFileName((scratch / "a.vtk").c_str());
            writer->Write();
            const auto lines = read_feature_lines(scratch / "a.vtk", context);
            INFO((lines ? "" : lines.error().one_line()));
            REQUIRE(lines);
            CHECK(lines->segments == kExpected);
        }
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetInputData(data);
    writer->SetFileName((scratch / "a.vtp").c_str());
    writer->Write();
    const auto lines = read_feature_lines(scratch / "a.vtp", context);
    REQUIRE(lines);
    CHECK(lines->segments == kExpected);
}

TEST_CASE("what is wrong with a file of feature lines is said with its place") {
    const auto message = [](const std::string& name, std::string text, const std::string& from,
                            const std::string& to) {
        if (!from.empty()) {
            REQUIRE(text.find(from) != std::string::npos);
            text.replace(text.find(from), from.size(), to);
        }
        const auto lines = read_text(name, text);
        REQUIRE(!lines);
        CHECK(lines.error().code == ErrorCode::bad_input);
        return lines.error().one_line();
    };
    const auto has = [](const std::string& text, const std::string& words) {
        INFO(text);
        CHECK(text.find(words) != std::string::npos);
    };
    has(message("a.eMesh", kFoam, "ascii", "binary"), "a.eMesh:7: format 'binary'");
    has(message("a.eMesh", kFoam, "featureEdgeMesh", "polyMesh"), "class 'polyMesh'");
    has(message("a.eMesh", kFoam, "(3 4)", "(3 5)"), "point 5 of 5");
    has(message("a.eMesh", kFoam, "(5 5 5)", "(5 x 5)"), "a.eMesh:19: 'x'");
    has(message("a.eMesh", kFoam, "\n5\n", "\n500000\n"), "500000 points");
    has(message("a.obj", kObj, "l 1/7 2 3", "l 1 2 9"), "point 8 (from 0) of 5");
    has(message("a.obj", kObj, "l 1/7 2 3", "l 1 2 0"), "a.obj:6: line entry '0'");
    has(message("a.obj", kObj, "v 1 0 0.5", "v 1 0"), "a.obj:4:");
    has(message("a.csv", kCsv, "1, 0, 0.5", "1, 0"), "a.csv:3:");
    has(message("a.csv", kCsv, "6 5 5", "6 5 inf"), "point 4 (from 0)");
    has(message("a.csv", "x,y,z\n", "", ""), "no lines");
    has(message("a.txt", "hello\n", "", ""), "no format");
    has(message("a.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n", "", ""),
        "no poly data");
    has(message("a.vtk",
                "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nLINES "
                "1 3\n9 0 1\n",
                "", ""),
        "a cell of 9 ids");
}

TEST_CASE("damaged files of feature lines end in an error or in lines") {
    const Scratch scratch;
    const auto data = make_polydata();
    std::vector<std::pair<std::string, std::string>> files = {
        {"a.eMesh", kFoam}, {"a.obj", kObj}, {"a.csv", kCsv}};
    for (bool binary : {false, true}) {
        vtkNew<vtkPolyDataWriter> writer;
        writer->SetInputData(data);
        binary ? writer->SetFileTypeToBinary() : writer->SetFileTypeToASCII();
        writer->SetFileName((scratch / "a.vtk").c_str());
        writer->Write();
        files.emplace_back("a.vtk", test::slurp(scratch / "a.vtk"));
    }
    std::mt19937 random(3);
    for (const auto& [name, text] : files) {
        for (std::size_t length = 0; length < text.size(); ++length)
            if (const auto lines = read_text(name, text.substr(0, length))) CHECK(!lines->segments.empty());
        for (int round = 0; round < 2000; ++round) {
            std::string damaged = text;
            for (int i = 0; i < 1 + round % 5; ++i)
                damaged[random() % damaged.size()] =
                    static_cast<char>(round % 2 ? random() % 256 : "0129 -()\n"[random() % 9]);
            const auto lines = read_text(name, damaged);
            if (lines)
                for (const auto& [a, b] : lines->segments)
                    REQUIRE(std::isfinite(a.x + a.y + a.z + b.x + b.y + b.z));
        }
    }
    CHECK(!read_text("a.eMesh", std::string(kFoam).substr(0, std::string(kFoam).size() - 8)));
}
