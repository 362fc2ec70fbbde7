#include "io/read_cad.hpp"

#include "io/cad_format.hpp"
#include "io/cad_shape.hpp"
#include "io/pack_cad.hpp"
#include "io/run_apart.hpp"
#include "io/scanner.hpp"
#include "io/surface_readers.hpp"

#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IGESBasic_Name.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESGraph_Color.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Quantity_Color.hxx>
#include <STEPConstruct_Styles.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepShape_FaceSurface.hxx>
#include <StepVisual_StyledItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <sstream>
#include <sys/mman.h>
#include <unistd.h>

namespace hexopt::io_detail {

namespace {

constexpr std::size_t kMemoryPerByte = 4096; ///< of a file: what its reading may take
constexpr unsigned kLongestSeconds = 900;    ///< of one core
constexpr double kSewing = 1e-5;             ///< gap that sewing closes, of the diagonal
constexpr double kUnbounded = 1e50;          ///< OpenCASCADE ends unbounded boxes at 1e100

/// Bytes under a name, for readers that only open files.
class MemoryFile {
  public:
    explicit MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("hexopt-cad", MFD_CLOEXEC)) {
        while (descriptor_ >= 0 && !bytes.empty()) {
            const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
            if (count <= 0) throw std::bad_alloc();
            bytes.remove_prefix(static_cast<std::size_t>(count));
        }
        if (descriptor_ < 0) throw std::bad_alloc();
    }
    ~MemoryFile() { ::close(descriptor_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    std::string name() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

  private:
    int descriptor_;
};

Error bad(const std::string& file, std::string reason, std::string advice) {
    return Error{ErrorCode::bad_input, "read", file, {std::move(reason), std::move(advice)}};
}

constexpr const char* kCheckModel = "write the model again, or export it as STL";

/// Calls act(label) for every face of a shape.
template <class Act>
void for_labels(FaceLabels& labels, const TopoDS_Shape& shape, const Act& act) {
    for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next()) {
        const TopoDS_Shape key = face.Current().Located(TopLoc_Location());
        if (!labels.IsBound(key)) labels.Bind(key, {});
        act(labels.ChangeFind(key));
    }
}

std::string text_of(const Handle(TCollection_HAsciiString) & text) {
    std::string name = text.IsNull() ? std::string() : text->ToCString();
    std::erase_if(name, [](char c) { return static_cast<unsigned char>(c) < ' '; });
    while (!name.empty() && name.back() == ' ') name.pop_back();
    name.erase(0, std::min(name.find_first_not_of(' '), name.size()));
    return name == "NONE" ? std::string() : name;
}

void read_step_colours(const Handle(XSControl_WorkSession) & session,
                       const Handle(Transfer_TransientProcess) & process, FaceLabels& labels) {
    STEPConstruct_Styles styles(session);
    if (!styles.LoadStyles()) return;
    for (int i = 1; i <= styles.NbStyles(); ++i) {
        const Handle(StepVisual_StyledItem) style = styles.Style(i);
        if (style.IsNull() || style->Item().IsNull()) continue;
        Handle(StepVisual_Colour) surface, boundary, curve, render;
        Standard_Real transparency = 0;
        Standard_Boolean is_component = false;
        if (!styles.GetColors(style, surface, boundary, curve, render, transparency, is_component)) continue;
        Quantity_Color colour;
        if (surface.IsNull() || !STEPConstruct_Styles::DecodeColor(surface, colour)) continue;
        const bool own = style->Item()->IsKind(STANDARD_TYPE(StepShape_FaceSurface));
        for_labels(labels, TransferBRep::ShapeResult(process, style->Item()), [&](FaceLabel& label) {
            if (label.own_colour && !own) return;
            label.colour = {colour.Red(), colour.Green(), colour.Blue()};
            label.own_colour = own;
        });
    }
}

void read_step_labels(const Handle(XSControl_WorkSession) & session, FaceLabels& labels) {
    const Handle(Transfer_TransientProcess) process = session->TransferReader()->TransientProcess();
    const Handle(Interface_InterfaceModel) model = session->Model();
    for (int i = 1; i <= model->NbEntities(); ++i) {
        const Handle(StepShape_FaceSurface) face = Handle(StepShape_FaceSurface)::DownCast(model->Value(i));
        if (face.IsNull()) continue;
        const std::string name = text_of(face->Name());
        if (name.empty()) continue;
        for_labels(labels, TransferBRep::ShapeResult(process, face),
                   [&](FaceLabel& label) { label.name = name; });
    }
    read_step_colours(session, process, labels);
}

Colour iges_colour(const IGESData_IGESEntity& entity) {
    if (const auto own = Handle(IGESGraph_Color)::DownCast(entity.Color()); !own.IsNull()) {
        double red = 0, green = 0, blue = 0;
        own->RGBIntensity(red, green, blue);
        const Quantity_Color colour(std::clamp(red / 100, 0.0, 1.0), std::clamp(green / 100, 0.0, 1.0),
                                    std::clamp(blue / 100, 0.0, 1.0), Quantity_TOC_sRGB);
        return Colour({colour.Red(), colour.Green(), colour.Blue()});
    }
    // The eight colours that IGES numbers: black, red, green, blue, yellow, magenta, cyan, white.
    constexpr double kNumbered[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                                        {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
    const int rank = entity.RankColor();
    if (rank < 1 || rank > 8) return std::nullopt;
    const auto& rgb = kNumbered[rank - 1];
    return Colour({rgb[0], rgb[1], rgb[2]});
}

void read_iges_labels(const Handle(XSControl_WorkSession) & session, FaceLabels& labels) {
    const Handle(Transfer_TransientProcess) process = session->TransferReader()->TransientProcess();
    const Handle(Interface_InterfaceModel) model = session->Model();
    for (int i = 1; i <= model->NbEntities(); ++i) {
        const Handle(IGESData_IGESEntity) entity = Handle(IGESData_IGESEntity)::DownCast(model->Value(i));
        if (entity.IsNull()) continue;
        const Handle(Standard_Type) name_type = STANDARD_TYPE(IGESBasic_Name);
        std::string name;
        if (entity->NbTypedProperties(name_type) == 1)
            name = text_of(Handle(IGESBasic_Name)::DownCast(entity->TypedProperty(name_type))->Value());
        const Colour colour = iges_colour(*entity);
        if (name.empty() && !colour) continue;
        const TopoDS_Shape shape = TransferBRep::ShapeResult(process, entity);
        const bool own = !shape.IsNull() && shape.ShapeType() == TopAbs_FACE;
        for_labels(labels, shape, [&](FaceLabel& label) {
            if (own && !name.empty()) label.name = name;
            if (!colour || (label.own_colour && !own)) return;
            label.colour = colour;
            label.own_colour = own;
        });
    }
}

bool load_step(std::string_view bytes, CadShape& cad) {
    STEPControl_Reader reader;
    Interface_Static::SetCVal("xstep.cascade.unit", "MM");
    std::istringstream stream{std::string(bytes)};
    if (reader.ReadStream("model", stream) != IFSelect_RetDone) return false;
    reader.TransferRoots();
    cad.shape = reader.OneShape();
    read_step_labels(reader.WS(), cad.labels);
    return true;
}

bool load_iges(std::string_view bytes, CadShape& cad) {
    IGESControl_Reader reader;
    Interface_Static::SetCVal("xstep.cascade.unit", "MM");
    const MemoryFile file(bytes);
    if (reader.ReadFile(file.name().c_str()) != IFSelect_RetDone) return false;
    reader.TransferRoots();
    cad.shape = reader.OneShape();
    read_iges_labels(reader.WS(), cad.labels);
    return true;
}

bool load_brep(std::string_view bytes, CadShape& cad) {
    // What precedes the topology is a viewer's heading.
    std::istringstream stream{std::string(bytes.substr(bytes.find("CASCADE")))};
    BRepTools::Read(cad.shape, stream, BRep_Builder());
    return !cad.shape.IsNull();
}

/// Collects the triangles of faces. Nodes on a common edge become one vertex: which, the topology says.
class Gatherer {
  public:
    explicit Gatherer(TriangleSoup& soup) : soup_(soup) {}

    /// False where the face has no triangles.
    bool add(const TopoDS_Face& face) {
        TopLoc_Location location;
        const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, location);
        if (triangles.IsNull() || triangles->NbTriangles() == 0) return false;
        triangles_ = triangles;
        place_ = location.Transformation();
        node_vertex_.assign(static_cast<std::size_t>(triangles->NbNodes()) + 1, kNoIndex);
        for (TopExp_Explorer edge(face.Oriented(TopAbs_FORWARD), TopAbs_EDGE); edge.More(); edge.Next())
            join(TopoDS::Edge(edge.Current()), location);
        const bool turned = (face.Orientation() == TopAbs_REVERSED) != (place_.IsNegative() == Standard_True);
        for (int t = 1; t <= triangles->NbTriangles(); ++t) {
            int a = 0, b = 0, c = 0;
            triangles->Triangle(t).Get(a, b, c);
            if (turned) std::swap(b, c);
            const std::array<Index, 3> ids{vertex_of(a), vertex_of(b), vertex_of(c)};
            if (ids[0] == ids[1] || ids[1] == ids[2] || ids[2] == ids[0]) continue; // at a cone's tip
            soup_.triangles.push_back(ids);
        }
        return true;
    }

  private:
    Index new_vertex(int node) {
        const gp_Pnt p = triangles_->Node(node).Transformed(place_);
        soup_.vertices.push_back({p.X(), p.Y(), p.Z()});
        return static_cast<Index>(soup_.vertices.size() - 1);
    }

    Index vertex_of(int node) {
        Index& vertex = node_vertex_[static_cast<std::size_t>(node)];
        if (vertex == kNoIndex) vertex = new_vertex(node);
        return vertex;
    }

    /// The entry of a shape, whatever its orientation, in a table that grows with its map.
    template <class Entry>
    static Entry& entry_of(TopTools_IndexedMapOfShape& map, std::vector<Entry>& table,
                           const TopoDS_Shape& shape, Entry initial) {
        const auto number = static_cast<std::size_t>(map.Add(shape));
        if (table.size() < number) table.resize(number, initial);
        return table[number - 1];
    }

    Index corner_of(const TopoDS_Vertex& vertex, int node) {
        if (vertex.IsNull()) return new_vertex(node);
        Index& id = entry_of(corners_, corner_vertex_, vertex, kNoIndex);
        if (id == kNoIndex) id = new_vertex(node);
        return id;
    }

    /// Gives the nodes of the current face on an edge the edge's vertices.
    void join(const TopoDS_Edge& edge, const TopLoc_Location& location) {
        const Handle(Poly_PolygonOnTriangulation) polygon =
            BRep_Tool::PolygonOnTriangulation(edge, triangles_, location);
        if (polygon.IsNull() || polygon->NbNodes() < 2) return;
        const int count = polygon->NbNodes();
        for (int i = 1; i <= count; ++i)
            if (polygon->Node(i) < 1 || polygon->Node(i) > triangles_->NbNodes()) return;
        std::vector<Index>& ids = entry_of(edges_, edge_vertices_, edge, std::vector<Index>{});
        if (ids.empty()) {
            TopoDS_Vertex first, last;
            TopExp::Vertices(TopoDS::Edge(edge.Oriented(TopAbs_FORWARD)), first, last);
            ids.push_back(corner_of(first, polygon->Node(1)));
            const bool shrunk = BRep_Tool::Degenerated(edge) == Standard_True;
            for (int i = 2; i < count; ++i) ids.push_back(shrunk ? ids[0] : new_vertex(polygon->Node(i)));
            ids.push_back(corner_of(last, polygon->Node(count)));
        }
        const bool same_nodes = ids.size() == static_cast<std::size_t>(count);
        for (int i = 1; i <= count; ++i) {
            if (!same_nodes && i != 1 && i != count) continue;
            Index& vertex = node_vertex_[static_cast<std::size_t>(polygon->Node(i))];
            const Index id = i == count ? ids.back() : ids[static_cast<std::size_t>(i) - 1];
            if (vertex == kNoIndex) vertex = id;
        }
    }

    TriangleSoup& soup_;
    Handle(Poly_Triangulation) triangles_; ///< of the current face
    gp_Trsf place_;
    std::vector<Index> node_vertex_; ///< of the current face; nodes count from 1
    TopTools_IndexedMapOfShape edges_, corners_;
    std::vector<std::vector<Index>> edge_vertices_;
    std::vector<Index> corner_vertex_;
};

/// Names distinguish nothing where all faces bear the same one.
bool names_differ(const TopTools_IndexedMapOfShape& faces, const FaceLabels& labels) {
    if (faces.Extent() < 2) return true;
    const std::string* first = nullptr;
    for (int f = 1; f <= faces.Extent(); ++f) {
        const FaceLabel* label = labels.Seek(faces(f).Located(TopLoc_Location()));
        if (label == nullptr || label->name.empty()) return true;
        if (first == nullptr) first = &label->name;
        if (label->name != *first) return true;
    }
    return false;
}

Result<CadSurface> gather(const std::string& file, const CadShape& cad, const TessellationOptions& options,
                          const Context& context, std::vector<std::string>& warnings) {
    TopTools_IndexedMapOfShape faces;
    TopExp::MapShapes(cad.shape, TopAbs_FACE, faces);
    CadSurface surface;
    surface.face_count = static_cast<std::size_t>(faces.Extent());
    SurfaceBuilder patches(context);
    Gatherer gatherer(surface.soup);
    const bool use_names = names_differ(faces, cad.labels);
    std::vector<Index>& group = surface.soup.patch_group;
    Index unnamed = kNoIndex; ///< the group of faces without a name
    for (int f = 1; f <= faces.Extent(); ++f) {
        const FaceLabel* label = cad.labels.Seek(faces(f).Located(TopLoc_Location()));
        const bool is_named = use_names && label != nullptr && !label->name.empty();
        const std::string name = is_named ? label->name : fmt::format("face_{}", f);
        if (!gatherer.add(TopoDS::Face(faces(f)))) {
            ++surface.failed_faces;
            warnings.push_back(
                fmt::format("{}: face {} ({}) could not be cut into triangles", file, f, name));
            continue;
        }
        const Index patch = patches.patch_of(name);
        if (patch == group.size()) group.push_back(patch);
        if (!is_named && !options.unnamed_borders) {
            if (unnamed == kNoIndex) unnamed = patch;
            group[patch] = unnamed;
        }
        surface.soup.patch.resize(surface.soup.triangles.size(), patch);
        surface.patch_colour.resize(patches.soup.patch_names.size());
        if (label != nullptr && !surface.patch_colour[patch]) surface.patch_colour[patch] = label->colour;
    }
    surface.soup.patch_names = std::move(patches.soup.patch_names);
    if (surface.soup.triangles.empty()) return bad(file, "no face gives triangles", kCheckModel);
    return surface;
}

/// IGES surfaces do not share their edges, whose triangles would not match.
void sew(CadShape& cad, double tolerance) {
    BRepBuilderAPI_Sewing sewing(tolerance);
    sewing.Add(cad.shape);
    sewing.Perform();
    if (sewing.SewedShape().IsNull()) return;
    FaceLabels labels;
    for (FaceLabels::Iterator old(cad.labels); old.More(); old.Next()) {
        labels.Bind(old.Key(), old.Value());
        if (sewing.IsModifiedSubShape(old.Key()))
            labels.Bind(sewing.ModifiedSubShape(old.Key()).Located(TopLoc_Location()), old.Value());
    }
    cad.shape = sewing.SewedShape();
    cad.labels = labels;
}

Status tessellate(const std::string& file, CadShape& cad, CadFormat format,
                  const TessellationOptions& options) {
    if (cad.shape.IsNull() || !TopExp_Explorer(cad.shape, TopAbs_FACE).More())
        return bad(file, "holds no faces", "give a model of solids or surfaces");
    BRepTools::Clean(cad.shape); // triangles in the file may be coarser than asked for
    Bnd_Box box;
    BRepBndLib::Add(cad.shape, box, Standard_False);
    if (box.IsVoid() || !(std::sqrt(box.SquareExtent()) < kUnbounded))
        return bad(file, "has no bounded extent", "trim its faces");
    const double diagonal = cad.diagonal = std::sqrt(box.SquareExtent());
    if (!(diagonal > 0)) return bad(file, "is a single point", kCheckModel);
    if (format == CadFormat::iges) sew(cad, kSewing * diagonal);
    IMeshTools_Parameters parameters;
    parameters.Deflection = options.deflection_rel * diagonal;
    parameters.Angle = options.angle_deg * std::numbers::pi / 180;
    parameters.InParallel = Standard_False; // the same triangles in every run
    BRepMesh_IncrementalMesh(cad.shape, parameters);
    return Done{};
}

Result<CadSurface> load_surface(CadFormat format, const std::string& file, std::string_view bytes,
                                const TessellationOptions& options, const Context& context,
                                std::vector<std::string>& warnings) {
    CadShape cad;
    if (const Status status = load_cad_shape(format, file, bytes, options, cad); !status)
        return status.error();
    return gather(file, cad, options, context, warnings);
}

} // namespace

Status load_cad_shape(CadFormat format, const std::string& file, std::string_view bytes,
                      const TessellationOptions& options, CadShape& cad) {
    const bool is_read = format == CadFormat::step   ? load_step(bytes, cad)
                         : format == CadFormat::iges ? load_iges(bytes, cad)
                                                     : load_brep(bytes, cad);
    if (!is_read) return bad(file, "OpenCASCADE cannot read it", kCheckModel);
    return tessellate(file, cad, format, options);
}

CadOutcome work_safely(const std::string& file, const std::function<void(CadOutcome&)>& work) {
    const auto failed = [](Error error) {
        CadOutcome outcome;
        outcome.error = std::move(error);
        return outcome;
    };
    const auto refused = [&](std::string_view reason) {
        return failed(bad(file, fmt::format("OpenCASCADE cannot read it ({})", shown(reason)), kCheckModel));
    };
    const auto no_memory = [&] {
        return failed(make_error(ErrorCode::out_of_memory, "read", file, "no memory for this model"));
    };
    try {
        Message::DefaultMessenger()->ChangePrinters().Clear();
        CadOutcome outcome;
        work(outcome);
        return outcome;
    } catch (const Standard_OutOfMemory&) {
        return no_memory();
    } catch (const Standard_Failure& failure) {
        return refused(failure.DynamicType()->Name());
    } catch (const std::bad_alloc&) {
        return no_memory();
    } catch (const std::exception& failure) {
        return refused(failure.what());
    }
}

Result<CadOutcome> work_on_cad_apart(CadFormat format, const std::string& file, std::string_view bytes,
                                     const TessellationOptions& options, const Context& context,
                                     const std::function<void(CadOutcome&)>& work) {
    if (!(options.deflection_rel >= 1e-7 && options.deflection_rel <= 0.1) ||
        !(options.angle_deg >= 1 && options.angle_deg <= 90))
        return make_error(
            ErrorCode::usage, "read", file,
            fmt::format("tessellation to {} of the diagonal and {} degrees; give 1e-7 to 0.1 and 1 to 90",
                        options.deflection_rel, options.angle_deg));
    if (const Status status = check_cad(format, file, bytes); !status) return status.error();
    // OpenCASCADE follows references that lead nowhere: a damaged file can crash it.
    const Result<std::string> packed = run_apart(file, kMemoryPerByte * bytes.size(), kLongestSeconds,
                                                 context, [&] { return pack(work_safely(file, work)); });
    if (!packed) return packed.error();
    CadOutcome outcome;
    if (!unpack(*packed, outcome)) return bad(file, "its reader ended early", kCheckModel);
    for (const std::string& warning : outcome.warnings) context.log(LogLevel::warning, warning);
    if (outcome.error) return *std::move(outcome.error);
    return outcome;
}

Result<CadSurface> read_cad_bytes(const std::string& file, std::string_view bytes,
                                  const TessellationOptions& options, const Context& context) {
    const CadFormat format = recognise_cad(file, bytes);
    Result<CadOutcome> outcome =
        work_on_cad_apart(format, file, bytes, options, context, [&](CadOutcome& out) {
            Result<CadSurface> surface = load_surface(format, file, bytes, options, context, out.warnings);
            if (surface)
                out.surface = std::move(*surface);
            else
                out.error = surface.error();
        });
    if (!outcome) return outcome.error();
    return std::move(outcome->surface);
}

} // namespace hexopt::io_detail

namespace hexopt {

bool cad_is_supported() { return true; }

} // namespace hexopt
