#include "domain/deviation.hpp"

#include "domain/boundary_model_builder.hpp"
#include "domain/closest_point.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 256;
constexpr int kMaxRounds = 40;

/// Part of a segment (N = 2) or triangle (N = 3) whose distance is to be bounded.
template <std::size_t N>
struct Piece {
    std::array<Point, N> corner;
    Index element;   ///< of the source
    Index hint;      ///< of the target
    double distance; ///< of the centre
    double upper;    ///< bound of the distance over the piece
};

double distance_to(const BoundaryModel& target, Index element, const Point& p, const Piece<3>&) {
    const auto& x = target.triangle(element);
    return glm::length(p - closest_on_triangle(p, x[0], x[1], x[2]).point);
}
double distance_to(const BoundaryModel& target, Index element, const Point& p, const Piece<2>&) {
    const auto& x = target.segment(element);
    return glm::length(p - closest_on_segment(p, x[0], x[1]).point);
}
Projection project_any(const BoundaryModel& target, const Point& p, const Piece<3>& piece) {
    return target.project_patch(kNoIndex, p, piece.hint);
}
Projection project_any(const BoundaryModel& target, const Point& p, const Piece<2>& piece) {
    return target.project_curve(kNoIndex, p, piece.hint);
}

template <std::size_t N>
Point centre_of(const std::array<Point, N>& x) {
    Point sum(0);
    for (const Point& p : x) sum += p;
    return sum / double(N);
}

double measure_of(const std::array<Point, 2>& x) { return glm::length(x[1] - x[0]); }
double measure_of(const std::array<Point, 3>& x) {
    return 0.5 * glm::length(glm::cross(x[1] - x[0], x[2] - x[0]));
}

/// One query at the centre. Two bounds: the distance grows by at most the way from the centre, and the
/// distance to the one element closest to the centre, which is convex, is largest at a corner.
template <std::size_t N>
void evaluate(const BoundaryModel& target, Piece<N>& piece) {
    const Point centre = centre_of(piece.corner);
    const Projection closest = project_any(target, centre, piece);
    piece.distance = closest.distance;
    piece.hint = closest.element;
    double reach = 0, at_corners = 0;
    for (const Point& x : piece.corner) {
        reach = std::max(reach, glm::length(x - centre));
        at_corners = std::max(at_corners, distance_to(target, closest.element, x, piece));
    }
    piece.upper = std::min({piece.upper, closest.distance + reach, at_corners});
    piece.distance = std::min(piece.distance, piece.upper); // rounding alone may have it the other way
}

/// Sides of the pieces of the target: planes across which the closest element changes, with outward normals.
struct Cut {
    Point origin, normal;
};

std::array<Cut, 2> sides_of(const std::array<Point, 2>& x) {
    return {{{x[0], x[0] - x[1]}, {x[1], x[1] - x[0]}}};
}
std::array<Cut, 3> sides_of(const std::array<Point, 3>& x) {
    const Point n = glm::cross(x[1] - x[0], x[2] - x[0]);
    return {{{x[0], glm::cross(x[1] - x[0], n)},
             {x[1], glm::cross(x[2] - x[1], n)},
             {x[2], glm::cross(x[0] - x[2], n)}}};
}

/// Signed heights of the corners over a cut.
template <std::size_t N>
std::array<double, N> heights(const std::array<Point, N>& corner, const Cut& cut) {
    std::array<double, N> h;
    for (std::size_t k = 0; k < N; ++k) h[k] = glm::dot(corner[k] - cut.origin, cut.normal);
    return h;
}

template <std::size_t N>
void add_part(const Piece<N>& piece, const std::array<Point, N>& corner, std::vector<Piece<N>>& parts) {
    parts.push_back(piece);
    parts.back().corner = corner;
}

void split_at(const Piece<2>& piece, const std::array<double, 2>& h, std::vector<Piece<2>>& parts) {
    const auto& x = piece.corner;
    const Point at = x[0] + h[0] / (h[0] - h[1]) * (x[1] - x[0]);
    add_part(piece, {x[0], at}, parts);
    add_part(piece, {at, x[1]}, parts);
}
/// One corner is cut off where it is alone on its side; a corner on the plane counts to the larger side.
void split_at(const Piece<3>& piece, const std::array<double, 3>& h, std::vector<Piece<3>>& parts) {
    int alone = 0;
    for (int k = 0; k < 3; ++k)
        if (h[k] * h[(k + 1) % 3] <= 0 && h[k] * h[(k + 2) % 3] <= 0 && h[k] != 0) alone = k;
    const int next = (alone + 1) % 3, last = (alone + 2) % 3;
    const auto& x = piece.corner;
    const Point a = x[alone] + h[alone] / (h[alone] - h[next]) * (x[next] - x[alone]);
    const Point b = x[alone] + h[alone] / (h[alone] - h[last]) * (x[last] - x[alone]);
    add_part(piece, {x[alone], a, b}, parts);
    if (h[next] != 0) add_part(piece, {a, x[next], x[last]}, parts);
    if (h[last] != 0) add_part(piece, {a, x[last], b}, parts);
}

void split_evenly(const Piece<2>& piece, std::vector<Piece<2>>& parts) { split_at(piece, {-1, 1}, parts); }
void split_evenly(const Piece<3>& piece, std::vector<Piece<3>>& parts) {
    const auto& x = piece.corner;
    const std::array<Point, 3> middle = {0.5 * (x[1] + x[2]), 0.5 * (x[2] + x[0]), 0.5 * (x[0] + x[1])};
    add_part(piece, {x[0], middle[2], middle[1]}, parts);
    add_part(piece, {middle[2], x[1], middle[0]}, parts);
    add_part(piece, {middle[1], middle[0], x[2]}, parts);
    add_part(piece, middle, parts);
}

const std::array<Point, 3>& element_of(const BoundaryModel& target, const Piece<3>& piece) {
    return target.triangle(piece.hint);
}
const std::array<Point, 2>& element_of(const BoundaryModel& target, const Piece<2>& piece) {
    return target.segment(piece.hint);
}

/// Cuts a piece along the side of the closest element that it extends across farthest: what lies over that
/// element is bounded tightly by its corners, so that surfaces which coincide need only the overlay of their
/// triangles. Pieces that lie over one element are split evenly.
template <std::size_t N>
void split(const Piece<N>& piece, const BoundaryModel& target, std::vector<Piece<N>>& parts) {
    double size = 0;
    for (const Point& x : piece.corner) size = std::max(size, glm::length(x - piece.corner[0]));
    double deepest = 1e-9 * size;
    std::array<double, N> at{};
    for (const Cut& cut : sides_of(element_of(target, piece))) {
        const double length = glm::length(cut.normal);
        if (!(length > 0)) continue;
        const std::array<double, N> h = heights(piece.corner, {cut.origin, cut.normal / length});
        const auto [low, high] = std::minmax_element(h.begin(), h.end());
        const double depth = std::min(-*low, *high);
        if (depth > deepest) deepest = depth, at = h;
    }
    if (deepest > 1e-9 * size)
        split_at(piece, at, parts);
    else
        split_evenly(piece, parts);
}

/// Refines all pieces that may hold the maximum, round by round, so that any number of threads gives the
/// same. result: what is attained already.
template <std::size_t N>
DirectedDeviation measure_directed(DirectedDeviation result, std::vector<Piece<N>> pieces,
                                   const BoundaryModel& target, const DeviationOptions& options,
                                   const Context& context) {
    std::size_t queries = 0;
    double sum = 0, measure = 0;
    for (int round = 0; !pieces.empty() && round < kMaxRounds; ++round) {
        context.parallel().for_each(pieces.size(), kChunk,
                                    [&](std::size_t i) { evaluate(target, pieces[i]); });
        queries += pieces.size();
        for (const Piece<N>& piece : pieces) {
            if (round == 0) {
                const double m = measure_of(piece.corner);
                measure += m;
                sum += m * piece.distance * piece.distance;
            }
            if (piece.distance <= result.largest) continue;
            result.largest = piece.distance;
            result.at = centre_of(piece.corner);
            result.element = piece.element;
        }
        const double enough = result.largest + std::max(options.tolerance * result.largest,
                                                        options.tolerance_rel * target.diagonal());
        const bool last = queries >= options.max_queries || round + 1 == kMaxRounds || context.is_cancelled();
        std::vector<Piece<N>> next;
        for (const Piece<N>& piece : pieces) {
            if (last || piece.upper <= enough)
                result.upper = std::max(result.upper, piece.upper);
            else
                split(piece, target, next);
        }
        pieces = std::move(next);
    }
    result.upper = std::max(result.upper, result.largest);
    result.rms = measure > 0 ? std::sqrt(sum / measure) : 0;
    return result;
}

/// Raises `result` by what is attained at the boundary's vertices, where the maximum mostly is.
DirectedDeviation measure_vertices(const HexMesh& mesh, std::span<const Quad> quads,
                                   const BoundaryModel& model, const Context& context) {
    std::vector<Index> face_of(mesh.vertex_count(), kNoIndex), vertices;
    for (Index q = 0; q < quads.size(); ++q)
        for (Index v : quads[q])
            if (face_of[v] == kNoIndex) face_of[v] = q, vertices.push_back(v);
    std::vector<double> distance(vertices.size());
    context.parallel().for_each(vertices.size(), kChunk, [&](std::size_t i) {
        distance[i] = model.distance(mesh.positions[vertices[i]]);
    });
    DirectedDeviation result;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (distance[i] <= result.largest) continue;
        result.largest = distance[i];
        result.at = mesh.positions[vertices[i]];
        result.element = face_of[vertices[i]];
    }
    return result;
}

std::vector<Piece<3>> pieces_of_triangles(const BoundaryModel& model, bool by_source) {
    std::vector<Piece<3>> pieces(model.triangle_count());
    for (Index t = 0; t < pieces.size(); ++t)
        pieces[t] = {model.triangle(t), by_source ? model.source_face(t) : t, kNoIndex, 0,
                     std::numeric_limits<double>::infinity()};
    return pieces;
}

std::vector<Piece<2>> pieces_of_segments(const BoundaryModel& model) {
    std::vector<Piece<2>> pieces(model.segment_count());
    for (Index s = 0; s < pieces.size(); ++s)
        pieces[s] = {model.segment(s), s, kNoIndex, 0, std::numeric_limits<double>::infinity()};
    return pieces;
}

/// The mesh's boundary as one patch and its feature edges as a curve each.
BoundaryModel build_distance_model(const HexMesh& mesh, std::span<const Quad> quads,
                                   std::span<const std::array<Index, 2>> feature_edges, double tolerance,
                                   double& bilinear_gap) {
    BoundaryModelParts parts;
    parts.vertices = mesh.positions;
    bilinear_gap = add_quads(quads, tolerance, parts);
    parts.patch.assign(parts.triangles.size(), 0);
    parts.patch_count = 1;
    for (const auto& edge : feature_edges) {
        parts.curve_vertex.item.insert(parts.curve_vertex.item.end(), edge.begin(), edge.end());
        parts.curve_vertex.offset.push_back(parts.curve_vertex.item.size());
        parts.curve_ends.push_back({0, 0}); // tangents are not used
    }
    return BoundaryModelBuilder::assemble(std::move(parts));
}

double largest_corner_distance(const HexMesh& mesh, const BoundaryModel& model) {
    double largest = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const Association a = model.associations()[v];
        if (a.kind == EntityKind::corner)
            largest = std::max(largest, glm::length(mesh.positions[v] - model.corner_point(a.entity)));
    }
    return largest;
}

} // namespace

Result<Deviation> measure_deviation(const HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                    const DeviationOptions& options, Context& context) {
    assert(mesh.vertex_count() == model.associations().size());
    if (Status ok = check_boundary(mesh, topology); !ok) return ok.error();
    const std::vector<Quad> quads = boundary_quads(mesh, topology);
    Deviation result;
    const BoundaryModel moved =
        build_distance_model(mesh, quads, model.feature_edges(), model.quad_tolerance(), result.bilinear_gap);
    result.diagonal = model.diagonal();
    result.mesh_to_surface = measure_directed(measure_vertices(mesh, quads, model, context),
                                              pieces_of_triangles(moved, true), model, options, context);
    result.surface_to_mesh = measure_directed({}, pieces_of_triangles(model, false), moved, options, context);
    if (model.segment_count() > 0 && moved.segment_count() > 0) {
        result.mesh_to_curves = measure_directed({}, pieces_of_segments(moved), model, options, context);
        result.curves_to_mesh = measure_directed({}, pieces_of_segments(model), moved, options, context);
    }
    result.largest_corner_distance = largest_corner_distance(mesh, model);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "deviation", "", "cancelled");
    return result;
}

} // namespace hexopt
