#include "stages/optimize/deviation_guard.hpp"

#include "domain/closest_point.hpp"

#include <algorithm>

namespace hexopt {

namespace {

/// Quads that come this close to the limit at nine points are sampled at 25.
constexpr double kRefineAbove = 0.6;
/// As much for the finer check: a warped quad over a hollow was 0.22 away at nine places, 0.45 between them.
constexpr double kLookCloselyAbove = 0.4;
constexpr double kStartMargin = 1.1; ///< how much more than at the start a quad may deviate
constexpr double kWithin = 0.8;      ///< share of its range that a vertex is pulled back to

/// Centre, corners and edge midpoints.
std::array<Point, 9> places_of(const std::array<Point, 4>& x) {
    std::array<Point, 9> places{quad_centre(x)};
    for (std::size_t k = 0; k < 4; ++k) {
        places[1 + 2 * k] = x[k];
        places[2 + 2 * k] = 0.5 * (x[k] + x[(k + 1) % 4]);
    }
    return places;
}

} // namespace

DeviationGuard::DeviationGuard(const HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                               const SurfaceLimits& limits, double allowed, const Parallel& parallel)
    : surface_(surface), topology_(topology), limits_(limits), start_allowed_(allowed),
      hint_(topology.boundary_faces.size(), kNoIndex), foot_(topology.boundary_faces.size()) {
    vertex_quad_.offset.assign(mesh.vertex_count() + 1, 0);
    for (CellFace face : topology.boundary_faces) {
        quads_.push_back(face_vertices(mesh, face));
        for (Index v : quads_.back()) ++vertex_quad_.offset[v + 1];
    }
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        if (vertex_quad_.offset[v + 1] > 0) boundary_vertices_.push_back(v);
        vertex_quad_.offset[v + 1] += vertex_quad_.offset[v];
    }
    vertex_quad_.item.resize(vertex_quad_.offset.back());
    std::vector<std::size_t> next(vertex_quad_.offset.begin(), vertex_quad_.offset.end() - 1);
    for (Index q = 0; q < quads_.size(); ++q)
        for (Index v : quads_[q]) vertex_quad_.item[next[v]++] = q;
    allowed_.assign(quads_.size(), 0.0f);
    parallel.for_each(quads_.size(), 64, [&](std::size_t q) {
        const double start = quad_deviation(limits.start, static_cast<Index>(q), allowed);
        allowed_[q] = static_cast<float>(start > allowed ? kStartMargin * start : allowed);
    });
    contact_.emplace(mesh, topology, quads_, vertex_quad_, limits.start, allowed, parallel);
}

/// At nine points of the quad, or at 25 if those deviate by more than refine_above.
double DeviationGuard::quad_deviation(std::span<const Point> positions, Index quad,
                                      double refine_above) const {
    std::array<Point, 4> x;
    for (int k = 0; k < 4; ++k) x[k] = positions[quads_[quad][k]];
    const std::array<Point, 9> places = places_of(x);
    double largest = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        const Projection on = surface_.project_patch(kNoIndex, places[i], hint_[quad]);
        if (i == 0) hint_[quad] = on.element;
        foot_[quad][i] = on.point;
        largest = std::max(largest, on.distance);
    }
    if (largest < refine_above) return largest;
    const Point centre = quad_centre(x);
    for (int k = 0; k < 4; ++k) {
        const Point next = 0.5 * (x[k] + x[(k + 1) % 4]), previous = 0.5 * (x[k] + x[(k + 3) % 4]);
        Index hint = hint_[quad];
        largest = std::max(largest, surface_.quad_deviation(
                                        std::array<Point, 4>{x[k], next, centre, previous}, kNoIndex, hint));
    }
    return largest;
}

namespace {

/// At (2^(levels + 1) + 1)^2 places of a quad.
double deviation_at_many(const BoundaryModel& surface, const std::array<Point, 4>& x, int levels,
                         Index& hint) {
    double largest = surface.quad_deviation(x, kNoIndex, hint);
    if (levels == 0) return largest;
    const Point centre = quad_centre(x);
    for (std::size_t k = 0; k < 4; ++k) {
        const Point next = 0.5 * (x[k] + x[(k + 1) % 4]), previous = 0.5 * (x[k] + x[(k + 3) % 4]);
        largest =
            std::max(largest, deviation_at_many(surface, {x[k], next, centre, previous}, levels - 1, hint));
    }
    return largest;
}

} // namespace

bool DeviationGuard::is_within(std::span<const Point> positions, double share,
                               const Parallel& parallel) const {
    constexpr int kLevels = 3;
    std::vector<std::uint8_t> beyond(quads_.size(), 0);
    parallel.for_each(quads_.size(), 64, [&](std::size_t q) {
        const auto quad = static_cast<Index>(q);
        if (is_near_last_feet(positions, quad, kLookCloselyAbove * allowed_[q])) return;
        std::array<Point, 4> x;
        for (std::size_t k = 0; k < 4; ++k) x[k] = positions[quads_[q][k]];
        Index hint = hint_[q];
        beyond[q] = deviation_at_many(surface_, x, kLevels, hint) > share * allowed_[q];
    });
    return std::find(beyond.begin(), beyond.end(), 1) == beyond.end();
}

/// The surface is no farther from a place than any point of it.
bool DeviationGuard::is_near_last_feet(std::span<const Point> positions, Index quad, double within) const {
    std::array<Point, 4> x;
    for (std::size_t k = 0; k < 4; ++k) x[k] = positions[quads_[quad][k]];
    const std::array<Point, 9> places = places_of(x);
    for (std::size_t i = 0; i < places.size(); ++i)
        if (!(glm::distance(places[i], foot_[quad][i]) < within)) return false;
    return true;
}

bool DeviationGuard::quad_deviates(std::span<const Point> positions, Index quad) const {
    const double allowed = allowed_[quad];
    if (is_near_last_feet(positions, quad, kRefineAbove * allowed)) return false;
    return quad_deviation(positions, quad, kRefineAbove * allowed) > allowed;
}

/// Whether a place of the input's boundary near a vertex is farther than allowed from the quads now around
/// it.
bool DeviationGuard::start_deviates(std::span<const Point> positions, Index vertex) const {
    const auto moved_little = [&](Index v) {
        return glm::distance(positions[v], limits_.start[v]) <= start_allowed_;
    };
    std::vector<Index> around;
    const auto is_covered = [&](const Point& place) {
        if (around.empty()) {
            for (Index q : vertex_quad_[vertex])
                for (Index w : quads_[q])
                    around.insert(around.end(), vertex_quad_[w].begin(), vertex_quad_[w].end());
            std::sort(around.begin(), around.end());
            around.erase(std::unique(around.begin(), around.end()), around.end());
        }
        return std::any_of(around.begin(), around.end(), [&](Index q) {
            std::array<Point, 4> x;
            for (int k = 0; k < 4; ++k) x[k] = positions[quads_[q][k]];
            const Point centre = quad_centre(x);
            for (int k = 0; k < 4; ++k)
                if (glm::distance(place, closest_on_triangle(place, x[k], x[(k + 1) % 4], centre).point) <=
                    start_allowed_)
                    return true;
            return false;
        });
    };
    if (!moved_little(vertex) && !is_covered(limits_.start[vertex])) return true;
    for (Index q : vertex_quad_[vertex]) {
        // A quad whose corners all moved little still covers its old edges and centre.
        if (std::all_of(quads_[q].begin(), quads_[q].end(), moved_little)) continue;
        const auto start = [&](int k) { return limits_.start[quads_[q][k % 4]]; };
        for (int k = 0; k < 4; ++k)
            if (quads_[q][k] == vertex && (!is_covered(0.5 * (start(k) + start(k + 1))) ||
                                           !is_covered(0.25 * (start(0) + start(1) + start(2) + start(3)))))
                return true;
    }
    return false;
}

std::vector<Index> DeviationGuard::violators(std::span<const Point> positions,
                                             std::span<const Index> vertices,
                                             const Parallel& parallel) const {
    std::vector<Index> quads, found;
    for (Index v : vertices) quads.insert(quads.end(), vertex_quad_[v].begin(), vertex_quad_[v].end());
    std::sort(quads.begin(), quads.end());
    quads.erase(std::unique(quads.begin(), quads.end()), quads.end());
    std::vector<std::uint8_t> quad_bad(quads.size()), start_bad(vertices.size());
    parallel.for_each(quads.size(), 64,
                      [&](std::size_t i) { quad_bad[i] = quad_deviates(positions, quads[i]); });
    parallel.for_each(vertices.size(), 64,
                      [&](std::size_t i) { start_bad[i] = start_deviates(positions, vertices[i]); });
    for (std::size_t i = 0; i < quads.size(); ++i)
        if (quad_bad[i]) found.insert(found.end(), quads_[quads[i]].begin(), quads_[quads[i]].end());
    for (Index q : contact_->touching(positions, quads, parallel))
        found.insert(found.end(), quads_[q].begin(), quads_[q].end());
    for (std::size_t i = 0; i < vertices.size(); ++i)
        if (start_bad[i])
            for (Index q : vertex_quad_[vertices[i]])
                found.insert(found.end(), quads_[q].begin(), quads_[q].end());
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

void BoundaryGuard::tighten(std::span<const Point> positions, std::span<const Index> violators, float share,
                            SurfaceLimits& limits) const {
    for (Index v : violators) {
        const auto moved = static_cast<float>(glm::distance(positions[v], limits.start[v]));
        limits.reach[v] = std::min(limits.reach[v], moved) * share;
        limits.band[v] *= share;
        limits.band_share[v] *= share;
    }
}

void DeviationGuard::pull_back(std::span<Point> positions, std::span<const Index> vertices) const {
    const auto bound = surface_.associations();
    for (Index v : vertices) {
        const Point start = limits_.start[v];
        const double moved = glm::distance(positions[v], start), range = kWithin * limits_.reach[v];
        if (!(moved > range)) continue;
        const Point inside = start + range / moved * (positions[v] - start);
        positions[v] = range > 0 && limits_.band[v] == 0 ? surface_.project(bound[v], inside).point : inside;
    }
}

} // namespace hexopt
