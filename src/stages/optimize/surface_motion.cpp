#include "stages/optimize/surface_motion.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace hexopt {

namespace {

constexpr double kNearEnd = 0.98;  ///< of its range: a vertex this far out counts as being at the end
constexpr double kReachFactor = 4; ///< generous: DeviationGuard narrows where the quads do deviate
constexpr float kUnlimited = std::numeric_limits<float>::infinity();

/// Largest of a few radii around the vertex's own edge length within which sliding stays within the
/// deviation.
float compute_reach(const BoundaryModel& surface, Association bound_to, const Point& at, double edge,
                    double deviation) {
    for (double radius = 8 * edge; radius > edge / 64; radius /= 2) {
        const double spread = surface.normal_spread(bound_to, at, radius);
        const double sine = spread >= 1.5707963 ? 1 : std::sin(spread);
        if (radius * sine <= kReachFactor * deviation)
            return radius == 8 * edge ? kUnlimited : static_cast<float>(radius);
    }
    return static_cast<float>(std::min(kReachFactor * deviation, edge));
}

} // namespace

SurfaceLimits compute_surface_limits(const HexMesh& mesh, const Topology& topology,
                                     const BoundaryModel& surface, double deviation,
                                     const Parallel& parallel) {
    SurfaceLimits limits;
    limits.start = mesh.positions;
    limits.reach.assign(mesh.vertex_count(), kUnlimited);
    limits.band.assign(mesh.vertex_count(), 0.0f);
    limits.band_share.assign(mesh.vertex_count(), 1.0f);
    const auto bound = surface.associations();
    parallel.for_each(mesh.vertex_count(), 256, [&](std::size_t v) {
        if (bound[v].kind != EntityKind::patch && bound[v].kind != EntityKind::curve) return;
        double edge = 0;
        for (CellCorner corner : topology.vertex_cell[v]) {
            const Cell& cell = mesh.cells[corner.cell];
            edge =
                std::max(edge, glm::distance(mesh.positions[cell[0]], mesh.positions[cell[6]]) / 1.7320508);
        }
        limits.start[v] = surface.project(bound[v], mesh.positions[v]).point;
        limits.reach[v] = compute_reach(surface, bound[v], limits.start[v], edge, deviation);
    });
    return limits;
}

SurfaceMotion::SurfaceMotion(const Problem& problem, const BoundaryModel& surface,
                             const SurfaceLimits& limits)
    : problem_(problem), surface_(surface), limits_(limits), hint_(problem.dof_count(), kNoIndex) {}

void SurfaceMotion::freedoms(std::span<const Point> positions, std::span<const Point> descent,
                             std::span<Freedom> out) const {
    const auto bound = surface_.associations();
    for (Index d = 0; d < out.size(); ++d) {
        const Index v = problem_.dof_vertex()[d];
        if (bound[v].kind == EntityKind::interior)
            out[d] = {};
        else
            out[d] = is_off_surface(v) ? in_band(d, positions[v], descent[d])
                                       : on_surface(d, positions[v], descent[d]);
    }
}

Freedom SurfaceMotion::on_surface(Index dof, const Point& at, const Point& descent) const {
    const Index v = problem_.dof_vertex()[dof];
    const Association bound = surface_.associations()[v];
    const Projection foot = surface_.project(bound, at, hint_[dof]);
    hint_[dof] = foot.element;
    const Point moved = at - limits_.start[v];
    const bool at_end =
        glm::length(moved) > kNearEnd * static_cast<double>(limits_.reach[v]) && glm::dot(moved, descent) > 0;
    if (bound.kind == EntityKind::curve)
        return {at_end ? Freedom::none : Freedom::line, foot.smooth_direction};
    if (bound.kind != EntityKind::patch) return {Freedom::none, Point(0)};
    if (!at_end) return {Freedom::plane, foot.smooth_direction};
    const Point along = glm::cross(foot.smooth_direction, moved);
    const double length = glm::length(along);
    return length > 0 ? Freedom{Freedom::line, along / length} : Freedom{Freedom::none, Point(0)};
}

Freedom SurfaceMotion::in_band(Index dof, const Point& at, const Point& descent) const {
    const Index v = problem_.dof_vertex()[dof];
    const Projection foot = surface_.project(surface_.associations()[v], at, hint_[dof]);
    hint_[dof] = foot.element;
    const auto leads_out = [&](const Point& offset, double end) {
        return glm::length(offset) > kNearEnd * end && glm::dot(offset, descent) > 0;
    };
    if (const Point offset = at - foot.point; leads_out(offset, limits_.band[v]))
        return {Freedom::plane, glm::normalize(offset)};
    if (const Point moved = foot.point - limits_.start[v]; leads_out(moved, limits_.reach[v]))
        return {Freedom::plane, glm::normalize(moved)};
    return {};
}

Point SurfaceMotion::place(Index dof, const Point& from, const Point& wanted) const {
    const Index v = problem_.dof_vertex()[dof];
    const Association bound = surface_.associations()[v];
    if (bound.kind == EntityKind::interior || wanted == from) return wanted;
    const auto on_entity = [&](const Point& query) {
        const Projection at = surface_.project(bound, query, hint_[dof]);
        hint_[dof] = at.element;
        return at.point;
    };
    // A limit narrowed since the vertex went out never forces it back in one jump: it may stay as far as it
    // is.
    const Point start = limits_.start[v];
    const double reach = std::max<double>(limits_.reach[v], glm::distance(from, start));
    Point foot = on_entity(wanted);
    const double moved = glm::distance(foot, start);
    const bool beyond = moved > reach;
    if (beyond) foot = on_entity(start + (foot - start) * (reach / moved));
    if (!is_off_surface(v)) return foot;
    const Point offset = beyond ? from - on_entity(from) : wanted - foot;
    const double height = glm::length(offset), band = limits_.band[v];
    return height <= band ? foot + offset : foot + offset * (band / height);
}

} // namespace hexopt
