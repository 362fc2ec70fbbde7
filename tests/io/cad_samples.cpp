#include "io/cad_samples.hpp"

#include "io/scratch.hpp"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <GeomAPI_PointsToBSpline.hxx>
#include <Geom_BSplineCurve.hxx>
#include <IGESControl_Writer.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_Color.hxx>
#include <STEPConstruct.hxx>
#include <STEPConstruct_Styles.hxx>
#include <STEPControl_Writer.hxx>
#include <StepData_StepModel.hxx>
#include <StepRepr_RepresentationContext.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepVisual_Colour.hxx>
#include <StepVisual_MechanicalDesignGeometricPresentationRepresentation.hxx>
#include <StepVisual_PresentationStyleAssignment.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <Transfer_FinderProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <gp_Elips.hxx>
#include <numbers>
#include <sstream>

namespace hexopt::test {

namespace {

struct Writer {
    Writer() { Message::DefaultMessenger()->ChangePrinters().Clear(); }
    void add(const TopoDS_Shape& shape) {
        REQUIRE(writer.Transfer(shape, STEPControl_AsIs) == IFSelect_RetDone);
    }
    void name(const TopoDS_Shape& face, const char* text) {
        const Handle(Transfer_FinderProcess) process = writer.WS()->TransferWriter()->FinderProcess();
        const Handle(StepRepr_RepresentationItem) item = STEPConstruct::FindEntity(process, face);
        REQUIRE(!item.IsNull());
        item->SetName(new TCollection_HAsciiString(text));
    }
    void colour(const TopoDS_Shape& shape, const Quantity_Color& rgb) {
        STEPConstruct_Styles styles(writer.WS());
        const Handle(StepVisual_Colour) colour = STEPConstruct_Styles::EncodeColor(rgb);
        const Handle(Transfer_FinderProcess) process = writer.WS()->TransferWriter()->FinderProcess();
        const Handle(StepRepr_RepresentationItem) item = STEPConstruct::FindEntity(process, shape);
        REQUIRE(!item.IsNull());
        styles.AddStyle(item, styles.MakeColorPSA(item, colour, colour, colour, 0.0), {});
        Handle(StepVisual_MechanicalDesignGeometricPresentationRepresentation) presentation;
        REQUIRE(styles.CreateMDGPR(styles.FindContext(shape), presentation));
        writer.Model()->AddWithRefs(presentation);
    }
    std::string bytes() {
        const Scratch scratch;
        const std::filesystem::path path = scratch / "model.step";
        REQUIRE(writer.Write(path.c_str()) == IFSelect_RetDone);
        return slurp(path);
    }
    STEPControl_Writer writer;
};

std::string brep(const TopoDS_Shape& shape) {
    std::ostringstream stream;
    BRepTools::Write(shape, stream);
    return stream.str();
}

} // namespace

std::string step_of_box() {
    const TopoDS_Shape box = BRepPrimAPI_MakeBox(2, 3, 4).Shape();
    Writer writer;
    writer.add(box);
    const char* names[] = {"inlet", "wall", "wall"};
    TopExp_Explorer face(box, TopAbs_FACE);
    for (const char* name : names) {
        writer.name(face.Current(), name);
        face.Next();
    }
    return writer.bytes();
}

std::string step_of_cylinder() {
    const TopoDS_Shape cylinder = BRepPrimAPI_MakeCylinder(1, 3).Shape();
    Writer writer;
    writer.add(cylinder);
    writer.colour(cylinder, Quantity_Color(1, 0, 0, Quantity_TOC_RGB));
    return writer.bytes();
}

std::string step_in_metres() {
    std::string bytes = step_of_box();
    const std::string unit = "SI_UNIT(.MILLI.,.METRE.)";
    const std::size_t at = bytes.find(unit);
    REQUIRE(at != std::string::npos);
    return bytes.replace(at, unit.size(), "SI_UNIT($,.METRE.)");
}

std::string step_of_assembly() {
    const TopoDS_Shape cube = BRepPrimAPI_MakeBox(1, 1, 1).Shape();
    gp_Trsf mirror, move;
    mirror.SetMirror(gp_Ax2(gp_Pnt(-1, 0, 0), gp_Dir(1, 0, 0)));
    move.SetTranslation(gp_Vec(5, 0, 0));
    BRep_Builder builder;
    TopoDS_Compound both;
    builder.MakeCompound(both);
    builder.Add(both, BRepBuilderAPI_Transform(cube, mirror).Shape());
    builder.Add(both, cube.Moved(TopLoc_Location(move)));
    Writer writer;
    writer.add(both);
    return writer.bytes();
}

std::string step_of_nose() {
    const auto arc = [](double from, double to) {
        const gp_Elips ellipse(gp_Ax2(gp_Pnt(2, 0, 0), gp_Dir(0, 0, 1), gp_Dir(1, 0, 0)), 2, 0.1);
        return BRepBuilderAPI_MakeEdge(ellipse, from * std::numbers::pi, to * std::numbers::pi).Edge();
    };
    const TopoDS_Edge back = BRepBuilderAPI_MakeEdge(gp_Pnt(2, -0.1, 0), gp_Pnt(2, 0.1, 0)).Edge();
    const TopoDS_Wire outline = BRepBuilderAPI_MakeWire(back, arc(0.5, 1), arc(1, 1.5)).Wire();
    Writer writer;
    writer.add(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(outline).Face(), gp_Vec(0, 0, 1)).Shape());
    return writer.bytes();
}

std::string step_of_sphere() {
    Writer writer;
    writer.add(BRepPrimAPI_MakeSphere(2).Shape());
    return writer.bytes();
}

std::string step_of_wire() {
    Writer writer;
    writer.add(
        BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(1, 0, 0)).Edge()).Shape());
    return writer.bytes();
}

std::string iges_of_cylinder() {
    const Scratch scratch;
    const std::filesystem::path path = scratch / "model.igs";
    Writer quiet;
    IGESControl_Writer writer("MM", 0);
    REQUIRE(writer.AddShape(BRepPrimAPI_MakeCylinder(1, 3).Shape()));
    writer.ComputeModel();
    REQUIRE(writer.Write(path.c_str()));
    return slurp(path);
}

std::string brep_of_torus() { return brep(BRepPrimAPI_MakeTorus(3, 1).Shape()); }

std::string brep_of_spline() {
    TColgp_Array1OfPnt points(1, 4);
    const double at[4][2] = {{0, 0}, {1, 1}, {2, 1.2}, {3, 0}};
    for (int i = 0; i < 4; ++i) points(i + 1) = gp_Pnt(at[i][0], at[i][1], 0);
    const Handle(Geom_BSplineCurve) curve = GeomAPI_PointsToBSpline(points).Curve();
    BRepBuilderAPI_MakeWire wire(BRepBuilderAPI_MakeEdge(curve).Edge(),
                                 BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(3, 0, 0)).Edge());
    return brep(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, 1)).Shape());
}

} // namespace hexopt::test
