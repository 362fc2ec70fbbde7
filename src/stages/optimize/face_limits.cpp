#include "stages/optimize/face_limits.hpp"

#include "domain/closest_point.hpp"
#include "stages/optimize/surface_motion.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace hexopt {

namespace {

constexpr double kFreeShare = 0.9; ///< of what is allowed of a face, within which nothing holds it back
constexpr std::size_t kSide = 5, kPlaces = kSide * kSide; ///< of a face

using Weights = std::array<double, 4>;

Weights weights_at(double u, double v) { return {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v}; }

std::array<Weights, kPlaces> make_places() {
    std::array<Weights, kPlaces> places;
    for (std::size_t i = 0; i < kSide; ++i)
        for (std::size_t j = 0; j < kSide; ++j)
            places[kSide * i + j] = weights_at(i / (kSide - 1.0), j / (kSide - 1.0));
    return places;
}

const std::array<Weights, kPlaces> kPlace = make_places();

Point mean(const Weights& weight, const Quad& quad, std::span<const Point> positions) {
    Point sum(0);
    for (std::size_t k = 0; k < 4; ++k) sum += weight[k] * positions[quad[k]];
    return sum;
}

bool is_within(const Point& a, const Point& b, double range) {
    const Point d = a - b;
    return glm::dot(d, d) < range * range;
}

} // namespace

FaceLimits::FaceLimits(const Problem& problem, const LimitedFaces& faces, const SurfaceLimits& limits)
    : faces_(faces), face_of_quad_(faces.quads.size(), kNoIndex) {
    for (std::size_t i = 0; i < problem.cell_count(); ++i)
        for (Index v : problem.cell(i))
            for (Index q : faces.vertex_quad[v]) {
                const CellFace face = faces.topology.boundary_faces[q];
                if (face.cell != problem.cell_id()[i] || face_of_quad_[q] != kNoIndex) continue;
                const Quad& quad = faces.quads[q];
                if (std::all_of(quad.begin(), quad.end(), [&](Index w) { return problem.shares(w).empty(); }))
                    continue;
                face_of_quad_[q] = static_cast<Index>(face_.size());
                Face moving{q, i, {}, faces.allowed[q]};
                const Cell& cell = problem.cell(i);
                float share = 1;
                for (std::size_t k = 0; k < 4; ++k) {
                    moving.corner[k] = static_cast<std::uint8_t>(
                        std::find(cell.begin(), cell.end(), quad[k]) - cell.begin());
                    share = std::min(share, limits.band_share[quad[k]]);
                }
                moving.range *= share;
                face_.push_back(moving);
            }
    place_.resize(kPlaces * face_.size());
    add_start_places(limits);
}

void FaceLimits::add_start_places(const SurfaceLimits& limits) {
    const auto add = [&](const Face& face, const Weights& weight) {
        const Quad& quad = faces_.quads[face.quad];
        const double share = face.range / faces_.allowed[face.quad];
        start_place_.push_back({mean(weight, quad, limits.start),
                                share * faces_.start_allowed,
                                face.quad,
                                face.quad,
                                weight,
                                {}});
    };
    for (const Face& face : face_) {
        const Quad& quad = faces_.quads[face.quad];
        add(face, {0.25, 0.25, 0.25, 0.25});
        for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t next = (k + 1) % 4;
            Weights weight{};
            if (quad[k] < quad[next]) { // the other face at the edge has it the other way round
                weight[k] = weight[next] = 0.5;
                add(face, weight);
            }
            const auto around = faces_.vertex_quad[quad[k]];
            const bool is_first = std::none_of(around.begin(), around.end(), [&](Index q) {
                return q < face.quad && face_of_quad_[q] != kNoIndex;
            });
            weight = {};
            weight[k] = 1;
            if (is_first) add(face, weight);
        }
    }
}

/// The surface is no farther from a place than any point of it.
bool FaceLimits::is_surely_within(const Point& at, Place& place, double range) const {
    if (place.element == kNoIndex) return false;
    if (is_within(at, place.foot, range)) return true;
    const auto& triangle = faces_.surface.triangle(place.element);
    place.foot = closest_on_triangle(at, triangle[0], triangle[1], triangle[2]).point;
    return is_within(at, place.foot, range);
}

/// Makes the place one of the quad if that is closer than `least`, which it then is.
void FaceLimits::look_at(std::span<const Point> positions, Index quad, StartPlace& place,
                         double& least) const {
    const Point at = place.at;
    std::array<Point, 4> x;
    for (std::size_t k = 0; k < 4; ++k) x[k] = positions[faces_.quads[quad][k]];
    const Point centre = quad_centre(x);
    double radius2 = 0;
    for (const Point& corner : x) radius2 = std::max(radius2, glm::dot(corner - centre, corner - centre));
    if (glm::distance(at, centre) - std::sqrt(radius2) >= least) return;
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t next = (k + 1) % 4;
        const auto closest = closest_on_triangle(at, x[k], x[next], centre);
        const double distance = glm::distance(at, closest.point);
        if (!(distance < least)) continue;
        least = distance;
        place.quad = quad;
        place.weight.fill(0.25 * closest.weight[2]);
        place.weight[k] += closest.weight[0];
        place.weight[next] += closest.weight[1];
    }
}

/// Among the faces round the one that it was on at the start, two rings of vertices. False: well within.
bool FaceLimits::find_closest(std::span<const Point> positions, StartPlace& place) const {
    double least = std::numeric_limits<double>::infinity();
    look_at(positions, place.quad, place, least);
    if (least < kFreeShare * place.range) return false;
    if (place.around.empty()) {
        for (Index v : faces_.quads[place.start_quad])
            for (Index q : faces_.vertex_quad[v])
                for (Index w : faces_.quads[q])
                    place.around.insert(place.around.end(), faces_.vertex_quad[w].begin(),
                                        faces_.vertex_quad[w].end());
        std::sort(place.around.begin(), place.around.end());
        place.around.erase(std::unique(place.around.begin(), place.around.end()), place.around.end());
    }
    // The same whatever was looked at first: what is as close is told apart by its number.
    least = std::nextafter(least, 2 * least);
    for (Index q : place.around) look_at(positions, q, place, least);
    return true;
}

/// Calls take(quad, weights, offset from where it should be, range) for places that may be near the end of
/// their range.
template <class Take>
void FaceLimits::visit(std::span<const Point> positions, const Take& take) const {
    for (std::size_t f = 0; f < face_.size(); ++f) {
        const Face& face = face_[f];
        for (std::size_t i = 0; i < kPlaces; ++i) {
            Place& place = place_[kPlaces * f + i];
            const Point at = mean(kPlace[i], faces_.quads[face.quad], positions);
            if (is_surely_within(at, place, kFreeShare * face.range)) continue;
            const Projection on = faces_.surface.project_patch(kNoIndex, at, place.element);
            place = {on.point, on.element};
            take(face.quad, kPlace[i], at - on.point, face.range);
        }
    }
    for (StartPlace& place : start_place_) {
        const auto now = [&] { return mean(place.weight, faces_.quads[place.quad], positions); };
        if (is_within(now(), place.at, kFreeShare * place.range)) continue;
        if (find_closest(positions, place)) take(place.quad, place.weight, now() - place.at, place.range);
    }
}

double FaceLimits::energy(std::span<const Point> positions) const {
    LimitTerm sum;
    visit(positions, [&](Index, const Weights&, const Point& offset, double range) {
        add_limit(offset, range, kFreeShare, sum);
    });
    return sum.energy;
}

void FaceLimits::append_terms(std::span<const Point> positions, std::vector<FaceTerm>& terms) const {
    visit(positions, [&](Index quad, const Weights& weight, const Point& offset, double range) {
        const Index f = face_of_quad_[quad];
        if (f == kNoIndex) return;
        FaceTerm term{face_[f].cell, face_[f].corner, weight, {}};
        add_limit(offset, range, kFreeShare, term.limit);
        if (term.limit.energy > 0) terms.push_back(term);
    });
}

} // namespace hexopt
