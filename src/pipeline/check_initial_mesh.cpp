#include "pipeline/check_initial_mesh.hpp"

#include "domain/closest_point.hpp"
#include "domain/triangle_tree.hpp"
#include "mesh/topology.hpp"
#include "quality/mesh_validity.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/common.hpp>
#include <optional>

namespace hexopt {

namespace {

/// How far beyond the sides of a box points count as on them, as a fraction of its diagonal.
constexpr double kOnSide_rel = 1e-6;

std::string place_of(const Point& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

Error not_enclosed(ErrorCode code, const char* what, const Point& p) {
    return Error{code,
                 "refine",
                 what,
                 {"the point " + place_of(p) + " of the surface is not inside",
                  "enclose all of it, or name the part that is to be meshed by --seeds"}};
}

/// The first corner of the surface's triangles for which `is_outside`.
template <class Outside>
std::optional<Point> find_corner(const BoundaryModel& model, const Parallel& parallel,
                                 const Outside& is_outside) {
    std::vector<std::uint8_t> outside(model.triangle_count(), 0);
    const auto find = [&](Index triangle) {
        const auto& corners = model.triangle(triangle);
        return std::find_if(corners.begin(), corners.end(), is_outside);
    };
    parallel.for_each(outside.size(), 256, [&](std::size_t t) {
        outside[t] = find(static_cast<Index>(t)) != model.triangle(static_cast<Index>(t)).end();
    });
    const auto first = std::find(outside.begin(), outside.end(), 1);
    if (first == outside.end()) return std::nullopt;
    return *find(static_cast<Index>(first - outside.begin()));
}

Status check_box(const BoundaryModel& model, const Box& box, const Parallel& parallel) {
    const Point margin(kOnSide_rel * glm::distance(box.low, box.high));
    const Point low = box.low - margin, high = box.high + margin;
    const auto outside = find_corner(model, parallel, [&](const Point& p) {
        return glm::any(glm::lessThan(p, low)) || glm::any(glm::greaterThan(p, high));
    });
    if (outside) return not_enclosed(ErrorCode::usage, "--box", *outside);
    return Done{};
}

Status check_cells(const HexMesh& mesh, const Parallel& parallel) {
    const std::vector<CellValidity> cells = compute_cell_validities(mesh, parallel);
    const auto is_turned = [](const CellValidity& cell) { return !cell.is_finite || cell.concave8 > 0; };
    const auto first = std::find_if(cells.begin(), cells.end(), is_turned);
    if (first == cells.end()) return Done{};
    Point centre(0);
    for (Index v : mesh.cells[static_cast<std::size_t>(first - cells.begin())])
        centre += 0.125 * mesh.positions[v];
    return Error{ErrorCode::bad_input,
                 "refine",
                 "initial mesh",
                 {fmt::format("{} of {} cells are concave, first cell {} at {}",
                              std::count_if(cells.begin(), cells.end(), is_turned), cells.size(),
                              first - cells.begin(), place_of(centre)),
                  "untangle it first (hexopt-gpu optimize)"}};
}

/// The boundary of a mesh, each quad as four triangles round its centre, which no choice of a diagonal bends.
std::vector<TriangleTree::Corners> boundary_triangles(const HexMesh& mesh, const Topology& topology) {
    std::vector<TriangleTree::Corners> triangles;
    triangles.reserve(4 * topology.boundary_faces.size());
    for (const CellFace& face : topology.boundary_faces) {
        std::array<Point, 4> x;
        Point centre(0);
        const Quad quad = face_vertices(mesh, face);
        for (std::size_t k = 0; k < 4; ++k) centre += 0.25 * (x[k] = mesh.positions[quad[k]]);
        for (std::size_t k = 0; k < 4; ++k) triangles.push_back({x[k], x[(k + 1) % 4], centre});
    }
    return triangles;
}

/// Half of the longest side: of those of boundary_triangles() half of an edge of their quad, about.
double half_edge(const TriangleTree::Corners& x) {
    return 0.5 * std::max({glm::distance(x[0], x[1]), glm::distance(x[1], x[2]), glm::distance(x[2], x[0])});
}

Status check_enclosed(const BoundaryModel& model, const HexMesh& mesh, const Parallel& parallel) {
    const auto triangles = boundary_triangles(mesh, compute_topology(mesh, parallel));
    const TriangleTree tree(triangles);
    double reach = 0;
    for (const auto& x : triangles) reach = std::max(reach, half_edge(x));
    const auto outside = find_corner(model, parallel, [&](const Point& p) {
        if (tree.winding_number(p, 2.5) > 0.75) return false;
        const Box near{p - Point(reach), p + Point(reach)};
        const bool is_near = tree.visit_box(near, [&](Index, const TriangleTree::Corners& x) {
            return glm::distance(p, closest_on_triangle(p, x[0], x[1], x[2]).point) <= half_edge(x);
        });
        return !is_near && !(tree.winding_number(p, std::numeric_limits<double>::infinity()) > 0.5);
    });
    if (outside) return not_enclosed(ErrorCode::bad_input, "initial mesh", *outside);
    return Done{};
}

} // namespace

Status check_initial_mesh(const Domain& domain, const MeshOptions& options, Context& context) {
    const InitialMeshOptions& initial = options.refine.initial;
    const bool has_seeds = !options.trim.seeds.empty();
    if (initial.box && !has_seeds)
        if (Status ok = check_box(domain.model, *initial.box, context.parallel()); !ok) return ok;
    if (!initial.mesh) return Done{};
    if (Status ok = check_cells(*initial.mesh, context.parallel()); !ok) return ok;
    return has_seeds ? Status(Done{}) : check_enclosed(domain.model, *initial.mesh, context.parallel());
}

} // namespace hexopt
