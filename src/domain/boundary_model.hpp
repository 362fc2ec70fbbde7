#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/box_tree.hpp"
#include "mesh/feature_lines.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"
#include "mesh/triangle_soup.hpp"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace hexopt {

/// What a mesh vertex is bound to.
enum class EntityKind : std::uint8_t {
    interior, ///< free in space
    patch,    ///< slides on a patch
    curve,    ///< slides on a feature curve
    corner,   ///< fixed
    hanging,  ///< placed by its masters (mesh.hanging); never associated itself
};

/// Binding of one vertex; `entity` numbers patches, curves and corners separately, kNoIndex for the others.
struct Association {
    EntityKind kind = EntityKind::interior;
    Index entity = kNoIndex;
    bool operator==(const Association&) const = default;
};

/// How features of a surface are recognised. Angles in degrees, 0..180.
struct BoundaryOptions {
    double feature_angle_deg = 35; ///< an edge is a feature where the normals beside it differ by more
    double corner_turn_deg = 60;   ///< a vertex on a curve that turns by more is a corner
    bool patch_borders = true;     ///< edges between named patches are features
    /// With a given surface: how far, in local edge lengths of the mesh, a feature vertex may be from a
    /// corner or curve to be bound to it; 0..2.
    double reach = 0.5;
};

/// Features given as lines, beside those by angle and patch.
struct GivenFeatures {
    std::span<const FeatureLines> lines = {};
    /// How far lines may be from the surface, as a fraction of its diagonal; 0..0.01.
    double reach_rel = 1e-3;
};

/// How well a mesh fits a given surface. All zero where the mesh's own boundary is the surface.
struct AssociationReport {
    struct FarVertex {
        Index vertex;
        double distance; ///< to what it is bound to, model units
    };
    double largest_distance = 0;         ///< of a bound vertex to its entity, model units
    std::vector<FarVertex> far_vertices; ///< the worst of those beyond `reach`, at most 20, worst first
    std::size_t far_count = 0;           ///< vertices beyond `reach` local edge lengths from their entity
    std::size_t unmatched_corners = 0;   ///< corners of the surface that no vertex is bound to
    std::size_t unmatched_curves = 0;    ///< curves that no mesh edge follows
    std::vector<std::string> unmatched_lines; ///< given ones that no edges follow: file and place
    std::size_t unmatched_vertices = 0;       ///< feature vertices of the mesh without a curve within `reach`
    std::size_t dropped_triangles = 0;        ///< with two equal vertices, or given twice
    std::size_t open_edges = 0;               ///< of the surface: used by one triangle; features
    std::size_t nonmanifold_edges = 0;        ///< of the surface: used by more than two; features
};

/// Closest point on an entity.
struct Projection {
    Point point = {};
    /// Unit normal of the closest triangle (patch) or unit tangent of the closest segment (curve); zero for
    /// corners, interior and hanging vertices and where the element is degenerate.
    Point direction = {};
    /// The same interpolated from the vertices' (angle-weighted within the patch; mean of the two segments on
    /// a curve): continuous over the entity.
    Point smooth_direction = {};
    Index element = kNoIndex; ///< triangle or segment: the hint for the next query nearby
    double distance = 0;      ///< from the query to `point`, model units
};

/// The directions in which a vertex may move: axis[0..freedom) are the unit tangents, the rest complete a
/// right-handed orthonormal basis (patch: axis[2] is the normal; curve: axis[0] is the tangent).
struct LocalFrame {
    std::array<Point, 3> axis;
    int freedom; ///< 0 corner and hanging, 1 curve, 2 patch, 3 interior
};

/// Where a triangle of the model comes from: a boundary face of the mesh (its place in
/// Topology::boundary_faces) or a triangle of the soup.
using SourceFace = Index;

/// The surface that boundary vertices slide on: patches of triangles, feature curves (polylines) and corners.
/// Immutable once built; all queries are const and thread-safe. A query costs about a microsecond; its result
/// does not depend on the hint, which only saves time.
class BoundaryModel {
  public:
    std::size_t patch_count() const { return patches_.size(); }
    std::size_t curve_count() const { return curves_.size(); }
    std::size_t corner_count() const { return corners_.size(); }
    std::size_t triangle_count() const { return triangles_.size(); }
    std::size_t segment_count() const { return segments_.size(); }

    /// Diagonal of the surface's bounding box, model units: what "relative" distances refer to.
    double diagonal() const { return diagonal_; }
    /// Quads are taken as triangles that follow their bilinear patches to within this, model units (5e-5 of
    /// the diagonal; more only in quads that are warped beyond 64 pieces).
    double quad_tolerance() const { return quad_tolerance_; }

    /// Binding of every vertex of the mesh that the model was built for.
    std::span<const Association> associations() const { return association_; }

    const AssociationReport& association_report() const { return report_; }
    /// Edges of the mesh that are to follow the model's curves, as pairs of vertices.
    std::span<const std::array<Index, 2>> feature_edges() const { return feature_edges_; }

    /// Closest point of patch `patch` (kNoIndex: of the whole surface). hint: `element` of an earlier result
    /// on the same patch, or kNoIndex.
    Projection project_patch(Index patch, const Point& query, Index hint = kNoIndex) const;
    /// Closest point of curve `curve` (kNoIndex: of all curves; then there must be one).
    Projection project_curve(Index curve, const Point& query, Index hint = kNoIndex) const;
    /// Closest point of what a vertex is bound to; interior and hanging vertices stay where they are.
    Projection project(Association bound_to, const Point& query, Index hint = kNoIndex) const;
    /// Tangent directions at a projection obtained from project() with the same association.
    LocalFrame local_frame(Association bound_to, const Projection& at) const;

    /// Distance from `query` to the closest point of the whole surface.
    double distance(const Point& query, Index hint = kNoIndex) const {
        return project_patch(kNoIndex, query, hint).distance;
    }
    /// Largest angle (radians) between the normals of the patch's triangles (the tangents of the curve's
    /// segments) that come within `radius` of `query`. Found by two sweeps, from the closest one and from the
    /// one farthest from that: exact for most shapes, never below half of the true value. 0 for the others.
    double normal_spread(Association bound_to, const Point& query, double radius) const;
    /// Largest distance to the surface from a quad's corners, edge midpoints and centre. patch: restricts the
    /// search, kNoIndex for the whole surface. hint as in project_patch; set to the centre's triangle.
    double quad_deviation(std::span<const Point, 4> corners, Index patch, Index& hint) const;

    const Point& corner_point(Index corner) const { return corners_[corner]; }
    /// Triangles of a patch, [first, last).
    std::array<Index, 2> patch_triangles(Index patch) const { return patches_[patch].element; }
    /// Corners of a triangle and ends of a segment, model units.
    const std::array<Point, 3>& triangle(Index triangle) const { return triangles_[triangle].corner; }
    const std::array<Point, 2>& segment(Index segment) const { return segments_[segment].end; }
    Index curve_of_segment(Index segment) const { return curve_of_segment_[segment]; }
    /// Unit normals of a triangle's corners, angle-weighted within its patch.
    const std::array<Point, 3>& vertex_normals(Index triangle) const {
        return triangle_vertex_normal_[triangle];
    }
    /// Unit tangents of a segment's ends, means of the two segments there.
    const std::array<Point, 2>& vertex_tangents(Index segment) const {
        return segment_vertex_tangent_[segment];
    }
    SourceFace source_face(Index triangle) const { return source_[triangle]; }
    Index patch_of_triangle(Index triangle) const { return patch_of_triangle_[triangle]; }
    /// Points of a curve in order; a closed one repeats its first point at the end.
    std::span<const Point> curve_points(Index curve) const { return curve_points_[curve]; }
    bool curve_closed(Index curve) const { return curves_[curve].closed; }
    /// Corners at the ends of a curve, kNoIndex for a closed one without a corner.
    std::array<Index, 2> curve_ends(Index curve) const { return curves_[curve].ends; }

  private:
    friend class BoundaryModelBuilder;

    struct Triangle {
        std::array<Point, 3> corner;
        Point normal; ///< unit; zero where the triangle is degenerate
    };
    struct Segment {
        std::array<Point, 2> end;
        Point tangent; ///< unit; zero where the segment is degenerate
    };
    struct Patch {
        std::array<Index, 2> element; ///< triangles [first, last)
        Index root;                   ///< in triangle_tree_
    };
    struct Curve {
        std::array<Index, 2> element; ///< segments [first, last)
        Index root;                   ///< in segment_tree_
        bool closed;
        std::array<Index, 2> ends; ///< corners
    };

    std::vector<Triangle> triangles_; ///< by patch, within one in the order of its tree's leaves
    std::vector<std::array<Point, 3>> triangle_vertex_normal_;
    std::vector<SourceFace> source_;
    std::vector<Index> patch_of_triangle_;
    std::vector<Segment> segments_; ///< by curve, within one in the order of its tree's leaves
    std::vector<std::array<Point, 2>> segment_vertex_tangent_;
    std::vector<Index> curve_of_segment_;
    std::vector<Patch> patches_;
    std::vector<Curve> curves_;
    std::vector<Point> corners_;
    Csr<Point> curve_points_;
    BoxTree triangle_tree_;
    BoxTree segment_tree_;
    Index all_triangles_ = kNoIndex; ///< root over all patches
    Index all_segments_ = kNoIndex;  ///< root over all curves, kNoIndex without any
    std::vector<Association> association_;
    std::vector<std::array<Index, 2>> feature_edges_;
    AssociationReport report_;
    double diagonal_ = 0;
    double quad_tolerance_ = 0;
};

/// Centre of a quad's bilinear patch.
inline Point quad_centre(const std::array<Point, 4>& x) { return 0.25 * ((x[0] + x[2]) + (x[1] + x[3])); }

/// The mesh's own boundary as the surface: each quad is its bilinear patch, as triangles that follow it to
/// within quad_tolerance() (four round the quad's centre, more where it is warped). Features: edges by angle
/// between the quads' normals, borders between patches of mesh.boundary, and edges that do not have exactly
/// two quads; and those along given lines (follow_lines(): every line needs edges that follow it). Corners:
/// vertices without exactly two feature edges (and not without any), sharp turns, ends of features by angle
/// where given ones go on, and vertices where the boundary touches itself. Errors: usage (an option out of
/// range); bad_input where there is no boundary, a position is not finite or no edges follow a line (with its
/// file and place); cancelled.
Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const BoundaryOptions& options, Context& context,
                                           const GivenFeatures& given = {});

/// The boundary of a mesh as triangles, e.g. to write as the surface that a changed mesh is compared with: as
/// close to the bilinear patches as the model's own, all quads in the same number of pieces, so that vertices
/// on common edges are equal (but repeated) and nothing gapes. Patches: those of mesh.boundary.
TriangleSoup boundary_soup(const HexMesh& mesh, const Topology& topology);

/// A given surface, on which the mesh's boundary is to lie. Equal vertices are merged; triangles with
/// two equal vertices or given twice are dropped. Features as above, from the triangles' normals and
/// soup.patch; open and non-manifold edges are features, and given lines, along which triangles are cut
/// (insert_features()). The mesh's corners are bound to corners and its
/// curves to curves within options.reach; its other boundary vertices to the nearest patch, preferring the
/// one that the neighbours are bound to; vertices that lie on a corner or curve are bound to it even where
/// the mesh has no feature. What does not match is in association_report(). Errors: usage; bad_input where an
/// id is out of range, a coordinate is not finite, no triangle is left or a line leaves the surface;
/// cancelled.
Result<BoundaryModel> build_boundary_model(const HexMesh& mesh, const Topology& topology,
                                           const TriangleSoup& surface, const BoundaryOptions& options,
                                           Context& context, const GivenFeatures& given = {});

} // namespace hexopt
