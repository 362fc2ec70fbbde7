#include "io/project_on_cad.hpp"

#include "core/digest.hpp"
#include "domain/box_tree.hpp"
#include "domain/closest_point.hpp"
#include "io/cad_shape.hpp"
#include "io/file_bytes.hpp"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRep_Tool.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <gp_Vec.hxx>
#include <memory>

namespace hexopt {

using namespace io_detail;

namespace {

constexpr double kReach = 20;        ///< deflections between a point on triangles and its exact one
constexpr int kSteps = 30;           ///< of Newton's method
constexpr double kConverged = 1e-13; ///< of the diagonal: a step that ends it

struct Uv {
    double u, v;
};

Point to_point(const gp_Pnt& p) { return {p.X(), p.Y(), p.Z()}; }
Point to_point(const gp_Vec& p) { return {p.X(), p.Y(), p.Z()}; }

/// The triangles, polylines and vertices of a shape, each with where it lies in the exact geometry.
class ExactGeometry {
  public:
    explicit ExactGeometry(const CadShape& cad) : diagonal_(cad.diagonal) {
        TopTools_IndexedMapOfShape faces;
        TopExp::MapShapes(cad.shape, TopAbs_FACE, faces);
        for (int f = 1; f <= faces.Extent(); ++f) add_face(TopoDS::Face(faces(f)));
        TopTools_IndexedMapOfShape vertices;
        TopExp::MapShapes(cad.shape, TopAbs_VERTEX, vertices);
        for (int v = 1; v <= vertices.Extent(); ++v)
            vertices_.push_back(to_point(BRep_Tool::Pnt(TopoDS::Vertex(vertices(v)))));
        build_trees();
    }

    /// match negative: there is none.
    CadPoint project(const CadQuery& query, double match, double reach) const {
        const CadPoint none{query.point, -1};
        const CadPoint at = query.dimension == 2   ? on_face(query.point, match)
                            : query.dimension == 1 ? on_edge(query.point, match)
                                                   : on_vertex(query.point, match);
        return at.match >= 0 && glm::distance(at.point, query.point) <= reach ? at : none;
    }

  private:
    struct Triangle {
        std::array<Point, 3> corner;
        std::array<Uv, 3> uv;
        Index face;
    };
    struct Segment {
        std::array<Point, 2> end;
        std::array<double, 2> t;
        Index edge;
    };

    void add_face(const TopoDS_Face& face) {
        TopLoc_Location location;
        const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
        if (mesh.IsNull() || mesh->NbTriangles() == 0 || !mesh->HasUVNodes()) return;
        const gp_Trsf place = location.Transformation();
        const auto number = static_cast<Index>(faces_.size());
        faces_.push_back(std::make_unique<BRepAdaptor_Surface>(face, Standard_True));
        for (int t = 1; t <= mesh->NbTriangles(); ++t) {
            std::array<int, 3> node{};
            mesh->Triangle(t).Get(node[0], node[1], node[2]);
            Triangle triangle;
            triangle.face = number;
            for (std::size_t k = 0; k < 3; ++k) {
                triangle.corner[k] = to_point(mesh->Node(node[k]).Transformed(place));
                const gp_Pnt2d uv = mesh->UVNode(node[k]);
                triangle.uv[k] = {uv.X(), uv.Y()};
            }
            triangles_.push_back(triangle);
        }
        for (TopExp_Explorer edge(face, TopAbs_EDGE); edge.More(); edge.Next())
            add_edge(TopoDS::Edge(edge.Current()), mesh, location, place);
    }

    void add_edge(const TopoDS_Edge& edge, const Handle(Poly_Triangulation) & mesh,
                  const TopLoc_Location& location, const gp_Trsf& place) {
        if (BRep_Tool::Degenerated(edge) || edges_seen_.Contains(edge)) return;
        const Handle(Poly_PolygonOnTriangulation) polygon =
            BRep_Tool::PolygonOnTriangulation(edge, mesh, location);
        if (polygon.IsNull() || !polygon->HasParameters()) return;
        edges_seen_.Add(edge);
        const auto number = static_cast<Index>(edges_.size());
        edges_.push_back(std::make_unique<BRepAdaptor_Curve>(edge));
        const auto node = [&](int i) { return to_point(mesh->Node(polygon->Node(i)).Transformed(place)); };
        for (int i = 1; i < polygon->NbNodes(); ++i) {
            if (polygon->Node(i) < 1 || polygon->Node(i + 1) < 1 || polygon->Node(i) > mesh->NbNodes() ||
                polygon->Node(i + 1) > mesh->NbNodes())
                return;
            segments_.push_back(
                {{node(i), node(i + 1)}, {polygon->Parameter(i), polygon->Parameter(i + 1)}, number});
        }
    }

    void build_trees() {
        Box frame;
        std::vector<Box> boxes(triangles_.size()), edge_boxes(segments_.size());
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            for (const Point& p : triangles_[t].corner) boxes[t].add(p);
            frame.add(boxes[t]);
        }
        for (std::size_t s = 0; s < segments_.size(); ++s) {
            for (const Point& p : segments_[s].end) edge_boxes[s].add(p);
            frame.add(edge_boxes[s]);
        }
        tree_ = BoxTree(frame);
        if (!boxes.empty()) triangle_root_ = tree_.add_tree(boxes, 0, triangle_order_);
        if (!edge_boxes.empty()) segment_root_ = tree_.add_tree(edge_boxes, 0, segment_order_);
    }

    CadPoint on_face(const Point& p, double match) const {
        if (triangle_root_ == kNoIndex) return {p, -1};
        double best2 = match * match;
        Index best = kNoIndex;
        ClosestPoint<3> closest{};
        tree_.visit_near(triangle_root_, p, best2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i) {
                const auto& [a, b, c] = triangles_[triangle_order_[i]].corner;
                const auto q = closest_on_triangle(p, a, b, c);
                const double d2 = glm::dot(q.point - p, q.point - p);
                if (d2 > best2 || (d2 == best2 && triangle_order_[i] >= best)) continue;
                best2 = d2;
                best = triangle_order_[i];
                closest = q;
            }
        });
        if (best == kNoIndex) return {p, -1};
        const Triangle& triangle = triangles_[best];
        Uv uv{0, 0};
        for (std::size_t k = 0; k < 3; ++k) {
            uv.u += closest.weight[k] * triangle.uv[k].u;
            uv.v += closest.weight[k] * triangle.uv[k].v;
        }
        return {closest_on_surface(*faces_[triangle.face], p, uv), std::sqrt(best2)};
    }

    CadPoint on_edge(const Point& p, double match) const {
        if (segment_root_ == kNoIndex) return {p, -1};
        double best2 = match * match;
        Index best = kNoIndex;
        ClosestPoint<2> closest{};
        tree_.visit_near(segment_root_, p, best2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i) {
                const Segment& segment = segments_[segment_order_[i]];
                const auto q = closest_on_segment(p, segment.end[0], segment.end[1]);
                const double d2 = glm::dot(q.point - p, q.point - p);
                if (d2 > best2 || (d2 == best2 && segment_order_[i] >= best)) continue;
                best2 = d2;
                best = segment_order_[i];
                closest = q;
            }
        });
        if (best == kNoIndex) return {p, -1};
        const Segment& segment = segments_[best];
        const double t = closest.weight[0] * segment.t[0] + closest.weight[1] * segment.t[1];
        return {closest_on_curve(*edges_[segment.edge], p, t), std::sqrt(best2)};
    }

    CadPoint on_vertex(const Point& p, double match) const {
        CadPoint best{p, -1};
        for (const Point& vertex : vertices_) {
            const double distance = glm::distance(vertex, p);
            if (distance <= match && (best.match < 0 || distance < best.match)) best = {vertex, distance};
        }
        return best;
    }

    /// Newton's method for the least distance, falling back to Gauss and Newton's where the Hessian is not
    /// positive, halving steps that lead away.
    Point closest_on_surface(const BRepAdaptor_Surface& surface, const Point& p, Uv uv) const {
        const auto bound = [&](Uv at) {
            return Uv{surface.IsUPeriodic()
                          ? at.u
                          : std::clamp(at.u, surface.FirstUParameter(), surface.LastUParameter()),
                      surface.IsVPeriodic()
                          ? at.v
                          : std::clamp(at.v, surface.FirstVParameter(), surface.LastVParameter())};
        };
        uv = bound(uv);
        Point best = to_point(surface.Value(uv.u, uv.v));
        for (int step = 0; step < kSteps; ++step) {
            gp_Pnt at;
            gp_Vec du, dv, duu, dvv, duv;
            surface.D2(uv.u, uv.v, at, du, dv, duu, dvv, duv);
            const Point r = to_point(at) - p, x = to_point(du), y = to_point(dv);
            const double gu = glm::dot(r, x), gv = glm::dot(r, y);
            double a = glm::dot(x, x) + glm::dot(r, to_point(duu)),
                   c = glm::dot(y, y) + glm::dot(r, to_point(dvv)),
                   b = glm::dot(x, y) + glm::dot(r, to_point(duv));
            if (!(a > 0 && a * c - b * b > 1e-12 * a * std::abs(c))) {
                a = glm::dot(x, x);
                b = glm::dot(x, y);
                c = glm::dot(y, y);
            }
            const double determinant = a * c - b * b;
            if (!(determinant > 1e-14 * a * c)) break; // a pole
            const Uv move{(b * gv - c * gu) / determinant, (b * gu - a * gv) / determinant};
            bool is_better = false;
            Point next = best;
            for (double scale = 1; scale > 1e-3 && !is_better; scale *= 0.5) {
                const Uv trial = bound({uv.u + scale * move.u, uv.v + scale * move.v});
                next = to_point(surface.Value(trial.u, trial.v));
                is_better = glm::distance(next, p) < glm::distance(best, p);
                if (is_better) uv = trial;
            }
            if (!is_better) break;
            const double moved = glm::distance(next, best);
            best = next;
            if (moved <= kConverged * diagonal_) break;
        }
        return best;
    }

    Point closest_on_curve(const BRepAdaptor_Curve& curve, const Point& p, double t) const {
        const auto bound = [&](double at) {
            return std::clamp(at, curve.FirstParameter(), curve.LastParameter());
        };
        t = bound(t);
        Point best = to_point(curve.Value(t));
        for (int step = 0; step < kSteps; ++step) {
            gp_Pnt at;
            gp_Vec d1, d2;
            curve.D2(t, at, d1, d2);
            const Point r = to_point(at) - p, x = to_point(d1);
            double slope = glm::dot(x, x) + glm::dot(r, to_point(d2));
            if (!(slope > 0)) slope = glm::dot(x, x);
            if (!(slope > 0)) break;
            const double move = -glm::dot(r, x) / slope;
            bool is_better = false;
            Point next = best;
            for (double scale = 1; scale > 1e-3 && !is_better; scale *= 0.5) {
                const double trial = bound(t + scale * move);
                next = to_point(curve.Value(trial));
                is_better = glm::distance(next, p) < glm::distance(best, p);
                if (is_better) t = trial;
            }
            if (!is_better) break;
            const double moved = glm::distance(next, best);
            best = next;
            if (moved <= kConverged * diagonal_) break;
        }
        return best;
    }

    double diagonal_;
    std::vector<std::unique_ptr<BRepAdaptor_Surface>> faces_;
    std::vector<std::unique_ptr<BRepAdaptor_Curve>> edges_;
    TopTools_IndexedMapOfShape edges_seen_;
    std::vector<Triangle> triangles_;
    std::vector<Segment> segments_;
    std::vector<Point> vertices_;
    BoxTree tree_;
    Index triangle_root_ = kNoIndex, segment_root_ = kNoIndex;
    std::vector<Index> triangle_order_, segment_order_;
};

} // namespace

Result<std::vector<std::optional<CadPoint>>>
project_on_cad(const std::filesystem::path& path, std::uint64_t digest,
               const TessellationOptions& tessellation, double match_rel, std::span<const CadQuery> queries,
               Context& context) {
    const Result<FileBytes> bytes = read_file(path, context);
    if (!bytes) return bytes.error();
    const std::string file = path.string();
    if (Digest().add(bytes->view()).value() != digest)
        return make_error(ErrorCode::bad_input, "cad projection", file,
                          "the file has changed since it was meshed");
    const CadFormat format = recognise_cad(file, bytes->view());
    const auto work = [&](CadOutcome& outcome) {
        CadShape cad;
        if (Status ok = load_cad_shape(format, file, bytes->view(), tessellation, cad); !ok) {
            outcome.error = ok.error();
            return;
        }
        const ExactGeometry geometry(cad);
        const double match = match_rel * cad.diagonal,
                     reach = match + kReach * tessellation.deflection_rel * cad.diagonal;
        for (const CadQuery& query : queries) outcome.points.push_back(geometry.project(query, match, reach));
    };
    Result<CadOutcome> outcome = work_on_cad_apart(format, file, bytes->view(), tessellation, context, work);
    if (!outcome) return outcome.error();
    if (outcome->points.size() != queries.size())
        return make_error(ErrorCode::bad_input, "cad projection", file, "its reader ended early");
    std::vector<std::optional<CadPoint>> points(queries.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        if (outcome->points[i].match >= 0) points[i] = outcome->points[i];
    return points;
}

} // namespace hexopt
