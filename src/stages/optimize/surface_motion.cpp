#include "stages/optimize/surface_motion.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace hexopt {

namespace {

constexpr double kFreeShare = 0.8; ///< of its range within which nothing holds a vertex back
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
    : problem_(problem), surface_(surface), limits_(limits), hint_(problem.dof_count(), kNoIndex) {
    const auto bound = surface.associations();
    for (Index d = 0; d < problem.dof_count(); ++d) {
        const Index v = problem.dof_vertex()[d];
        if (bound[v].kind != EntityKind::interior && (is_off_surface(v) || limits.reach[v] < kUnlimited))
            limited_.push_back(d);
    }
}

Projection SurfaceMotion::project(Index dof, const Point& query) const {
    const Projection at =
        surface_.project(surface_.associations()[problem_.dof_vertex()[dof]], query, hint_[dof]);
    hint_[dof] = at.element;
    return at;
}

void SurfaceMotion::freedoms(std::span<const Point> positions, std::span<Freedom> out) const {
    const auto bound = surface_.associations();
    for (Index d = 0; d < out.size(); ++d) {
        const Index v = problem_.dof_vertex()[d];
        out[d] = {};
        if (bound[v].kind == EntityKind::interior || is_off_surface(v)) continue;
        if (bound[v].kind == EntityKind::patch)
            out[d] = {Freedom::plane, project(d, positions[v]).smooth_direction};
        else if (bound[v].kind == EntityKind::curve)
            out[d] = {Freedom::line, project(d, positions[v]).smooth_direction};
        else
            out[d] = {Freedom::none, Point(0)};
    }
}

Point SurfaceMotion::place(Index dof, const Point& wanted) const {
    const Index v = problem_.dof_vertex()[dof];
    if (surface_.associations()[v].kind == EntityKind::interior || is_off_surface(v)) return wanted;
    return project(dof, wanted).point;
}

namespace {

/// Adds s^2 with s rising from 0 at kFreeShare of the range to 1 at its end.
void add_limit(const Point& offset, double range, LimitTerm& term) {
    const double length = glm::length(offset), free = kFreeShare * range;
    if (!(length > free)) return;
    const double width = std::max((1 - kFreeShare) * range, 1e-3 * length), s = (length - free) / width;
    const Point direction = offset / length;
    term.energy += s * s;
    term.gradient += (2 * s / width) * direction;
    term.hessian += (2 / (width * width)) * glm::outerProduct(direction, direction);
}

} // namespace

LimitTerm SurfaceMotion::limit(Index dof, const Point& at) const {
    const Index v = problem_.dof_vertex()[dof];
    LimitTerm term;
    const Point foot = is_off_surface(v) ? project(dof, at).point : at;
    if (limits_.reach[v] < kUnlimited) add_limit(foot - limits_.start[v], limits_.reach[v], term);
    if (is_off_surface(v)) add_limit(at - foot, limits_.band[v], term);
    return term;
}

} // namespace hexopt
