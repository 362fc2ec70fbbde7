#include "stages/optimize/surface_motion.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace hexopt {

namespace {

constexpr double kFreeShare = 0.8; ///< of its range within which nothing holds a vertex back
constexpr double kReachFactor = 1;
constexpr float kUnlimited = std::numeric_limits<float>::infinity();

/// Largest angle between the direction at a place of the surface and those found about `radius` away from it.
/// diagonal: looks between the frame's axes instead of along them.
double direction_spread(const BoundaryModel& surface, Association bound_to, const Projection& at,
                        double radius, bool diagonal) {
    LocalFrame frame = surface.local_frame(bound_to, at);
    if (diagonal && frame.freedom == 2) {
        const Point u = frame.axis[0], v = frame.axis[1];
        frame.axis[0] = 0.70710678 * (u + v);
        frame.axis[1] = 0.70710678 * (u - v);
    }
    double least_cosine = 1;
    for (int axis = 0; axis < frame.freedom; ++axis)
        for (double sign : {-1.0, 1.0}) {
            const Projection near =
                surface.project(bound_to, at.point + sign * radius * frame.axis[axis], at.element);
            least_cosine = std::min(least_cosine, glm::dot(near.smooth_direction, at.smooth_direction));
        }
    return std::acos(std::max(least_cosine, -1.0));
}

/// How far sliding stays within a multiple of the deviation, from the bend of the surface up to four of the
/// vertex's own edges away.
float compute_reach(const BoundaryModel& surface, Association bound_to, const Projection& at, double edge,
                    double deviation) {
    const double allowed = kReachFactor * deviation;
    double inner = std::min(allowed, edge / 4), widest = 0;
    bool diagonal = false;
    for (double radius = edge / 4; radius <= 4 * edge; radius *= 2, diagonal = !diagonal) {
        widest = std::max(widest, 2 * direction_spread(surface, bound_to, at, radius, diagonal));
        if (radius * std::sin(std::min(widest, 1.5707963)) > allowed)
            // The bend grows with the radius about linearly.
            return static_cast<float>(std::max(inner, radius * std::sqrt(allowed / (radius * widest))));
        inner = radius;
    }
    return kUnlimited;
}

} // namespace

SurfaceLimits unlimited_on_surface(std::span<const Point> positions) {
    SurfaceLimits limits;
    limits.start.assign(positions.begin(), positions.end());
    limits.reach.assign(positions.size(), std::numeric_limits<float>::infinity());
    limits.band.assign(positions.size(), 0);
    limits.band_share.assign(positions.size(), 1);
    return limits;
}

SurfaceLimits compute_surface_limits(const HexMesh& mesh, const Topology& topology,
                                     const BoundaryModel& surface, std::span<const Point> positions,
                                     double deviation, const Parallel& parallel) {
    SurfaceLimits limits;
    limits.start.assign(positions.begin(), positions.end());
    limits.reach.assign(mesh.vertex_count(), kUnlimited);
    limits.band.assign(mesh.vertex_count(), 0.0f);
    limits.band_share.assign(mesh.vertex_count(), 1.0f);
    const auto bound = surface.associations();
    parallel.for_each(mesh.vertex_count(), 256, [&](std::size_t v) {
        if (bound[v].kind != EntityKind::patch && bound[v].kind != EntityKind::curve) return;
        double edge = 0;
        for (CellCorner corner : topology.vertex_cell[v]) {
            const Cell& cell = mesh.cells[corner.cell];
            edge = std::max(edge, glm::distance(positions[cell[0]], positions[cell[6]]) / 1.7320508);
        }
        const Projection at = surface.project(bound[v], positions[v]);
        limits.start[v] = at.point;
        limits.reach[v] = compute_reach(surface, bound[v], at, edge, deviation);
    });
    return limits;
}

SurfaceMotion::SurfaceMotion(const Problem& problem, const BoundaryModel& surface,
                             const SurfaceLimits& limits, Tangents tangents, const LimitedFaces* faces)
    : problem_(problem), surface_(surface), limits_(limits), tangents_(tangents),
      place_(problem.dof_count(), kNoIndex) {
    const auto bound = surface.associations();
    for (Index d = 0; d < problem.dof_count(); ++d) {
        const Index v = problem.dof_vertex()[d];
        if (bound[v].kind == EntityKind::interior) continue;
        place_[d] = static_cast<Index>(on_surface_.size());
        on_surface_.push_back(d);
        if (!faces && (is_off_surface(v) || limits.reach_of(v) < kUnlimited)) limited_.push_back(d);
    }
    if (faces) faces_.emplace(problem, *faces, limits);
    last_.resize(on_surface_.size());
}

Projection SurfaceMotion::project(Index dof, const Point& query) const {
    Last& known = last(dof);
    const Projection at =
        surface_.project(surface_.associations()[problem_.dof_vertex()[dof]], query, known.element);
    known = {query, at.point, tangents_ == Tangents::smooth ? at.smooth_direction : at.direction, at.element};
    return at;
}

void SurfaceMotion::freedoms(std::span<const Point> positions, std::span<Freedom> out) const {
    const auto bound = surface_.associations();
    for (std::size_t i = 0; i < out.size(); ++i) {
        const Index d = on_surface_[i], v = problem_.dof_vertex()[d];
        out[i] = {};
        if (is_off_surface(v)) continue;
        out[i] = {Freedom::none, Point(0)};
        if (bound[v].kind == EntityKind::corner) continue;
        // Where place() put it, the direction is known.
        if (last_[i].element == kNoIndex || last_[i].foot != positions[v]) project(d, positions[v]);
        out[i] = {bound[v].kind == EntityKind::patch ? Freedom::plane : Freedom::line, last_[i].direction};
    }
}

Point SurfaceMotion::place(Index dof, const Point& wanted) const {
    const Index v = problem_.dof_vertex()[dof];
    if (surface_.associations()[v].kind == EntityKind::interior || is_off_surface(v)) return wanted;
    return project(dof, wanted).point;
}

double SurfaceMotion::face_energy(std::span<const Point> positions) const {
    return faces_ ? faces_->energy(positions) : 0;
}

void SurfaceMotion::append_face_terms(std::span<const Point> positions, std::vector<FaceTerm>& terms) const {
    if (faces_) faces_->append_terms(positions, terms);
}

void add_limit(const Point& offset, double range, double free_share, LimitTerm& term) {
    const double length = glm::length(offset), free = free_share * range;
    if (!(length > free)) return;
    const double width = std::max((1 - free_share) * range, 1e-3 * length), s = (length - free) / width;
    const Point direction = offset / length;
    term.energy += s * s;
    term.gradient += (2 * s / width) * direction;
    term.hessian += (2 / (width * width)) * glm::outerProduct(direction, direction);
}

/// Whether the last projection shows that nothing holds a dof off the surface back here: the distance to the
/// surface grows by no more than the way.
bool SurfaceMotion::is_well_within(Index dof, const Point& at) const {
    const Last& known = last(dof);
    const Index v = problem_.dof_vertex()[dof];
    if (known.element == kNoIndex) return false;
    const double distance = glm::distance(at, known.foot);
    return distance <= kFreeShare * limits_.band[v] &&
           glm::distance(at, limits_.start[v]) + distance <= kFreeShare * limits_.reach[v];
}

LimitTerm SurfaceMotion::limit(Index dof, const Point& at) const {
    const Index v = problem_.dof_vertex()[dof];
    LimitTerm term;
    if (is_off_surface(v) && is_well_within(dof, at)) return term;
    const Last& known = last(dof);
    const bool is_known = known.element != kNoIndex && known.query == at;
    const Point foot = !is_off_surface(v) ? at : is_known ? known.foot : project(dof, at).point;
    if (limits_.reach_of(v) < kUnlimited)
        add_limit(foot - limits_.start[v], limits_.reach[v], kFreeShare, term);
    if (is_off_surface(v)) add_limit(at - foot, limits_.band[v], kFreeShare, term);
    return term;
}

} // namespace hexopt
