#pragma once

#include "core/random.hpp"
#include "domain/associate.hpp"
#include "domain/boundary_model_builder.hpp"
#include "domain/boundary_polygons.hpp"
#include "domain/domain.hpp"
#include "domain/fitted_mesh.hpp"
#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"
#include "mesh/validate_structure.hpp"
#include "samples/box_mesh.hpp"
#include "stages/buffer/buffer.hpp"
#include "stages/optimize/optimize.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <set>

namespace hexopt::test {

struct FittedShape {
    Domain domain;
    FittedMesh fitted;
};

/// Boxes of a forest of octrees of 2^levels lattice cells a root, mapped.
struct BoxShape {
    std::array<std::uint32_t, 3> roots = {4, 4, 4};
    int levels = 0;
    std::function<bool(Point)> inside = {}; ///< by a cell's centre, units of roots
    std::function<bool(Point)> refine = {}; ///< by a cell's centre
    std::function<Point(Point)> map = {};
};

inline HexMesh make_mesh(const BoxShape& shape) {
    OctreeOptions options;
    options.roots = shape.roots;
    options.levels = shape.levels;
    options.refine = [&](Point low, Point high) { return shape.refine && shape.refine(0.5 * (low + high)); };
    if (shape.inside) options.keep = [&](Point low, Point high) { return shape.inside(0.5 * (low + high)); };
    auto mesh = make_box_mesh(make_octree_boxes(options), lattice_units(shape.levels));
    if (!mesh) FAIL(mesh.error().one_line());
    if (shape.map)
        for (Point& x : mesh->positions) x = shape.map(x);
    apply_hanging(*mesh, Parallel(1));
    mesh->revision = 1;
    return std::move(mesh).value();
}

/// Binds a mesh whose boundary lies on `surface` to it by where its vertices are.
inline FittedShape fit_exactly(HexMesh mesh, const TriangleSoup& surface,
                               const BoundaryOptions& options = {}) {
    Context context(1);
    auto domain = build_domain(surface, options, context);
    if (!domain) FAIL(domain.error().one_line());
    const BoundaryModel& model = domain->model;
    const Topology topology = compute_topology(mesh);
    const FeatureGraph graph = compute_feature_graph(
        mesh.positions, compute_boundary_polygons(mesh, topology), feature_limits(options));
    SurfaceAssociation bound = associate(mesh, topology, graph, model, 0.5, context);
    FittedShape shape{std::move(domain).value(), {}};
    for (CellFace face : topology.boundary_faces) {
        const Quad q = face_vertices(mesh, face);
        Point centre(0);
        for (Index v : q) centre += 0.25 * mesh.positions[v];
        const Projection at = shape.domain.model.project_patch(kNoIndex, centre);
        mesh.boundary.push_back({q, shape.domain.model.patch_of_triangle(at.element)});
    }
    for (std::size_t p = 0; p < shape.domain.model.patch_count(); ++p)
        mesh.patch_names.push_back("patch " + std::to_string(p));
    for (auto [a, b] : bound.feature_edges) {
        const Association x = bound.association[a], y = bound.association[b];
        Index curve = x.kind == EntityKind::curve ? x.entity : y.entity;
        if (x.kind != EntityKind::curve && y.kind != EntityKind::curve) {
            const Point middle = 0.5 * (mesh.positions[a] + mesh.positions[b]);
            curve = shape.domain.model.curve_of_segment(
                shape.domain.model.project_curve(kNoIndex, middle).element);
        }
        shape.fitted.ridges.push_back({std::min(a, b), std::max(a, b), curve});
    }
    std::sort(shape.fitted.ridges.begin(), shape.fitted.ridges.end());
    shape.fitted.association = std::move(bound.association);
    shape.fitted.mesh = std::move(mesh);
    return shape;
}

/// The mesh's own boundary as the domain.
inline FittedShape fit_to_itself(HexMesh mesh) {
    const TriangleSoup soup = boundary_soup(mesh, compute_topology(mesh));
    return fit_exactly(std::move(mesh), soup);
}

/// All of the mesh's boundary quads, sound: structure, constraints, closed manifold of given Euler number
/// (-100: any), every boundary face listed once with its patch.
inline int check_sound(const FittedMesh& fitted) {
    const HexMesh& mesh = fitted.mesh;
    for (const Violation& violation : validate_structure(mesh, Parallel(1))) FAIL(violation.one_line());
    REQUIRE(fitted.association.size() == mesh.vertex_count());
    const Topology topology = compute_topology(mesh);
    std::set<Quad> listed;
    for (const BoundaryQuad& quad : mesh.boundary) {
        Quad key = quad.vertices;
        std::sort(key.begin(), key.end());
        REQUIRE(listed.insert(key).second);
    }
    REQUIRE(topology.boundary_faces.size() == mesh.boundary.size());
    std::map<std::array<Index, 2>, int> edges;
    std::set<Index> vertices;
    const SurfacePolygons polygons = compute_boundary_polygons(mesh, topology);
    for (std::size_t f = 0; f < polygons.vertex.rows(); ++f) {
        Quad key = face_vertices(mesh, topology.boundary_faces[f]);
        std::sort(key.begin(), key.end());
        REQUIRE(listed.count(key) == 1);
        const auto loop = polygons.vertex[f];
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Index a = loop[i], b = loop[(i + 1) % loop.size()];
            vertices.insert(a);
            REQUIRE(++edges[{a, b}] == 1);
        }
    }
    for (const auto& [edge, count] : edges) REQUIRE(edges.count({edge[1], edge[0]}) == 1);
    const auto may_end_ridge = [&](Index v) {
        const EntityKind kind = fitted.association[v].kind;
        return kind == EntityKind::curve || kind == EntityKind::corner || kind == EntityKind::hanging;
    };
    for (const FittedMesh::RidgeEdge& ridge : fitted.ridges) {
        REQUIRE(may_end_ridge(ridge.a));
        REQUIRE(may_end_ridge(ridge.b));
    }
    return static_cast<int>(vertices.size()) - static_cast<int>(edges.size() / 2) +
           static_cast<int>(polygons.vertex.rows());
}

inline FittedShape make_cube(std::uint32_t n) { return fit_to_itself(make_mesh({{n, n, n}})); }

/// One ridge of 270 degrees; 2n by 2n cells without a quarter, 2n high.
inline FittedShape make_l_prism(std::uint32_t n) {
    BoxShape shape{{2 * n, 2 * n, 2 * n}};
    shape.inside = [n](Point p) { return p.x < n || p.y < n; };
    return fit_to_itself(make_mesh(shape));
}

/// A slab of 3n by 3n by n cells that carries a box of n by n by n in its middle.
inline FittedShape make_box_on_slab(std::uint32_t n) {
    BoxShape shape{{3 * n, 3 * n, 2 * n}};
    shape.inside = [n](Point p) { return p.z < n || (p.x > n && p.x < 2 * n && p.y > n && p.y < 2 * n); };
    return fit_to_itself(make_mesh(shape));
}

/// A box of 3n cells a side with a hollow of n a side in the middle.
inline FittedShape make_hollow_cube(std::uint32_t n) {
    BoxShape shape{{3 * n, 3 * n, 3 * n}};
    shape.inside = [n](Point p) {
        const auto out = [n](double x) { return x < n || x > 2 * n; };
        return out(p.x) || out(p.y) || out(p.z);
    };
    return fit_to_itself(make_mesh(shape));
}

/// A cube without one octant: three concave ridges that meet.
inline FittedShape make_notched_cube(std::uint32_t n) {
    BoxShape shape{{2 * n, 2 * n, 2 * n}};
    shape.inside = [n](Point p) { return p.x < n || p.y < n || p.z < n; };
    return fit_to_itself(make_mesh(shape));
}

/// Disc of radius 1 that a square grid is mapped onto: four flat quads a layer on each rim.
inline Point to_cylinder(Point p, double cells) {
    const double x = 2 * p.x / cells - 1, y = 2 * p.y / cells - 1;
    const double shell = std::max(std::abs(x), std::abs(y)), length = std::hypot(x, y);
    const double s = length > 0 ? shell / length : 0;
    return {x * s, y * s, 2 * p.z / cells};
}

inline HexMesh make_cylinder_mesh(std::uint32_t n, int levels = 0, std::function<bool(Point)> refine = {}) {
    BoxShape shape{{n, n, n}, levels, {}, std::move(refine)};
    shape.map = [n](Point p) { return to_cylinder(p, n); };
    return make_mesh(shape);
}

inline FittedShape make_cylinder(std::uint32_t n, int levels = 0, std::function<bool(Point)> refine = {}) {
    const HexMesh fine = make_cylinder_mesh(48);
    const TriangleSoup soup = boundary_soup(fine, compute_topology(fine));
    HexMesh mesh = make_cylinder_mesh(n, levels, std::move(refine));
    FittedShape shape = fit_exactly(std::move(mesh), soup);
    HexMesh& m = shape.fitted.mesh;
    for (Index v = 0; v < m.vertex_count(); ++v)
        m.positions[v] = shape.domain.model.project(shape.fitted.association[v], m.positions[v]).point;
    apply_hanging(m, Parallel(1));
    return shape;
}

/// Moves the mesh of a buffered shape to rest on its domain.
inline OptimizeStats settle(FittedMesh& fitted, const Domain& domain, Context& context, double min_sj = 1) {
    BoundaryModel model = domain.model;
    std::vector<std::array<Index, 2>> features;
    for (const FittedMesh::RidgeEdge& ridge : fitted.ridges) features.push_back({ridge.a, ridge.b});
    BoundaryModelBuilder::bind(model, fitted.association, std::move(features), {}, 1e-4 * model.diagonal());
    OptimizeOptions options;
    options.time_limit_s = 60;
    options.min_sj = min_sj;
    auto stats = optimize(fitted.mesh, compute_topology(fitted.mesh), &model, options, context);
    if (!stats) FAIL(stats.error().one_line());
    return std::move(stats).value();
}

} // namespace hexopt::test
