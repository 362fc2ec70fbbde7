#include "domain/deviation.hpp"

#include "domain/boundary_model_builder.hpp"
#include "domain/closest_point.hpp"
#include "domain/sampled_distance.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 256;
constexpr Index kMaxCutsInARow = 60;
constexpr std::size_t kBatch = 1 << 12; ///< pieces refined together, which bounds the memory

/// Part of a segment (N = 2) or triangle (N = 3) whose distance is to be bounded: convex, with two ends or at
/// most kMostCorners corners in order.
constexpr std::size_t kMostCorners = 16;
/// Corners of a piece that may be cut three times: one more each time, but slivers that rounding has made
/// concave may be crossed at every side, from 5 to 7 to 10 to 15 corners.
constexpr std::size_t kMostToCut = 5;
template <std::size_t N>
struct Piece {
    static constexpr std::size_t kCapacity = N == 2 ? 2 : kMostCorners;
    std::array<Point, kCapacity> corner;
    Index count;     ///< of corners
    Index element;   ///< of the source
    Index hint;      ///< of the target
    Index cuts = 0;  ///< that led to it
    double distance; ///< of the centre
    double upper;    ///< bound of the distance over the piece

    std::span<const Point> corners() const { return {corner.data(), count}; }
};

/// Pieces that wait, without room for corners that they have not: there may be very many.
template <std::size_t N>
class PieceStack {
  public:
    std::size_t size() const { return rest_.size(); }

    void push(const Piece<N>& piece) {
        rest_.push_back({piece.count, piece.element, piece.hint, piece.cuts, piece.distance, piece.upper});
        corner_.insert(corner_.end(), piece.corner.begin(), piece.corner.begin() + piece.count);
    }

    /// Takes the last `count` off, in the order in which they came.
    void take(std::size_t count, std::vector<Piece<N>>& pieces) {
        const std::size_t first = size() - count;
        std::size_t corners = 0;
        for (std::size_t i = first; i < size(); ++i) corners += rest_[i].count;
        auto from = corner_.end() - static_cast<std::ptrdiff_t>(corners);
        pieces.clear();
        for (std::size_t i = first; i < size(); ++i) {
            const Rest& r = rest_[i];
            pieces.push_back({{}, r.count, r.element, r.hint, r.cuts, r.distance, r.upper});
            std::copy_n(from, r.count, pieces.back().corner.begin());
            from += r.count;
        }
        rest_.resize(first);
        corner_.resize(corner_.size() - corners);
    }

    double largest_upper() const {
        double largest = 0;
        for (const Rest& r : rest_) largest = std::max(largest, r.upper);
        return largest;
    }

  private:
    struct Rest {
        Index count, element, hint, cuts;
        double distance, upper;
    };
    std::vector<Rest> rest_;
    std::vector<Point> corner_;
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
Point centre_of(const Piece<N>& piece) {
    Point sum(0);
    for (const Point& p : piece.corners()) sum += p;
    return sum / static_cast<double>(piece.count);
}

double measure_of(const Piece<2>& piece) { return glm::length(piece.corner[1] - piece.corner[0]); }
double measure_of(const Piece<3>& piece) {
    const auto& x = piece.corner;
    return 0.5 * glm::length(glm::cross(x[1] - x[0], x[2] - x[0]));
}

/// Bounds a piece by one element alone: the distance to it is convex, so that it is largest at a corner.
template <std::size_t N>
void bound_by(const BoundaryModel& target, Index element, Piece<N>& piece) {
    double at_corners = 0;
    for (const Point& x : piece.corners())
        at_corners = std::max(at_corners, distance_to(target, element, x, piece));
    piece.upper = std::min(piece.upper, at_corners);
}

/// One query at the centre. Two bounds: the distance grows by at most the way from the centre, and that of
/// the closest element.
template <std::size_t N>
void evaluate(const BoundaryModel& target, Piece<N>& piece) {
    const Point centre = centre_of(piece);
    const Projection closest = project_any(target, centre, piece);
    piece.distance = closest.distance;
    piece.hint = closest.element;
    double reach = 0;
    for (const Point& x : piece.corners()) reach = std::max(reach, glm::length(x - centre));
    piece.upper = std::min(piece.upper, closest.distance + reach);
    bound_by(target, closest.element, piece);
    piece.distance = std::min(piece.distance, piece.upper); // rounding alone may have it the other way
}

/// Plane that cuts a piece, e.g. along a side of an element of the target, across which the closest element
/// changes; with outward normal.
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
using Heights = std::array<double, Piece<N>::kCapacity>;

template <std::size_t N>
Heights<N> heights_over(const Piece<N>& piece, const Cut& cut) {
    Heights<N> h{};
    for (std::size_t k = 0; k < piece.count; ++k) h[k] = glm::dot(piece.corner[k] - cut.origin, cut.normal);
    return h;
}

Point point_at(const Point& a, const Point& b, double height_a, double height_b) {
    return a + height_a / (height_a - height_b) * (b - a);
}

/// The part of a piece on the far side of a plane that passes through it; the piece is left with the other.
Piece<2> cut_off(Piece<2>& piece, const Heights<2>& h) {
    Piece<2> rest = piece;
    const Point at = point_at(piece.corner[0], piece.corner[1], h[0], h[1]);
    (h[0] > 0 ? piece : rest).corner[0] = at;
    (h[0] > 0 ? rest : piece).corner[1] = at;
    return rest;
}
/// Corners on the plane go to both parts.
Piece<3> cut_off(Piece<3>& piece, const Heights<3>& h) {
    Piece<3> rest = piece, kept = piece;
    rest.count = kept.count = 0;
    for (Index k = 0; k < piece.count; ++k) {
        const Index next = k + 1 < piece.count ? k + 1 : 0;
        if (h[k] >= 0) rest.corner[rest.count++] = piece.corner[k];
        if (h[k] <= 0) kept.corner[kept.count++] = piece.corner[k];
        if (!(h[k] * h[next] < 0)) continue;
        const Point at = point_at(piece.corner[k], piece.corner[next], h[k], h[next]);
        rest.corner[rest.count++] = kept.corner[kept.count++] = at;
    }
    piece = kept;
    return rest;
}

/// Across the middle of the longest way between corners.
template <std::size_t N>
void halve(Piece<N> piece, std::vector<Piece<N>>& parts) {
    Cut cut{};
    double longest2 = -1;
    for (Index i = 0; i < piece.count; ++i)
        for (Index j = i + 1; j < piece.count; ++j) {
            const Point way = piece.corner[j] - piece.corner[i];
            if (const double length2 = glm::dot(way, way); length2 > longest2)
                longest2 = length2, cut = {0.5 * (piece.corner[i] + piece.corner[j]), way};
        }
    parts.push_back(cut_off(piece, heights_over(piece, cut)));
    parts.push_back(piece);
}

/// Divides along a diagonal what has too many corners to be cut; false where it has not.
bool divide(const Piece<2>&, std::vector<Piece<2>>&) { return false; }
bool divide(Piece<3> piece, std::vector<Piece<3>>& parts) {
    if (piece.count <= kMostToCut) return false;
    const Index middle = piece.count / 2;
    Piece<3> rest = piece;
    rest.count = 0;
    for (Index k = middle; k < piece.count; ++k) rest.corner[rest.count++] = piece.corner[k];
    rest.corner[rest.count++] = piece.corner[0];
    piece.count = middle + 1;
    parts.push_back(rest);
    parts.push_back(piece);
    return true;
}

const std::array<Point, 3>& element_of(const BoundaryModel& target, const Piece<3>& piece) {
    return target.triangle(piece.hint);
}
const std::array<Point, 2>& element_of(const BoundaryModel& target, const Piece<2>& piece) {
    return target.segment(piece.hint);
}

/// Cuts a piece along the sides of the closest element. What lies over that element is bounded tightly by its
/// corners, without another query, so that surfaces which coincide need only the overlay of their triangles;
/// it is dropped where that is `enough`, and its bound returned. Pieces that lie over one element are halved.
template <std::size_t N>
double split(Piece<N> piece, const BoundaryModel& target, double enough, std::vector<Piece<N>>& parts) {
    if (divide(piece, parts)) return 0;
    double size = 0;
    for (const Point& x : piece.corners()) size = std::max(size, glm::length(x - piece.corner[0]));
    bool cut_any = false;
    for (const Cut& cut : sides_of(element_of(target, piece))) {
        const double length = glm::length(cut.normal);
        if (!(length > 0)) continue;
        const Heights<N> h = heights_over(piece, {cut.origin, cut.normal / length});
        const auto [low, high] = std::minmax_element(h.begin(), h.begin() + piece.count);
        if (!(std::min(-*low, *high) > 1e-9 * size)) continue;
        parts.push_back(cut_off(piece, h));
        cut_any = true;
    }
    if (!cut_any) {
        halve(piece, parts);
        return 0;
    }
    bound_by(target, piece.hint, piece);
    if (piece.upper <= enough) return piece.upper;
    parts.push_back(piece);
    return 0;
}

/// Branch and bound over the pieces of one direction.
template <std::size_t N>
class DirectedMeasure {
  public:
    /// result: what is attained already.
    DirectedMeasure(DirectedDeviation result, const BoundaryModel& target, const DeviationOptions& options,
                    const Context& context)
        : result_(result), target_(target), options_(options), context_(context) {}

    /// The first queries at all of `count` pieces, then batch by batch what may hold the maximum. make(i)
    /// gives a piece.
    template <class Make>
    DirectedDeviation run(std::size_t count, const Make& make) {
        const std::vector<First> first = look_at_all(count, make);
        std::vector<Piece<N>> open;
        for (std::size_t i = 0; i < count; ++i) {
            if (first[i].upper <= enough()) {
                result_.upper = std::max(result_.upper, first[i].upper);
            } else {
                open.push_back(make(i));
                open.back().hint = first[i].hint;
                open.back().upper = first[i].upper;
            }
            if (open.size() < kBatch && i + 1 < count) continue;
            refine(open);
            open.clear();
        }
        result_.upper = std::max(result_.upper, result_.largest);
        return result_;
    }

  private:
    struct First {
        double upper;
        Index hint;
    };

    double enough() const {
        return result_.largest +
               std::max(options_.tolerance * result_.largest, options_.tolerance_rel * target_.diagonal());
    }

    void attain(const Piece<N>& piece) {
        if (piece.distance <= result_.largest) return;
        result_.largest = piece.distance;
        result_.at = centre_of(piece);
        result_.element = piece.element;
    }

    template <class Make>
    std::vector<First> look_at_all(std::size_t count, const Make& make) {
        std::vector<First> first(count);
        std::vector<double> distance(count);
        context_.parallel().for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
            Index hint = kNoIndex; // neighbours in the list are neighbours in space
            for (std::size_t i = begin; i < end; ++i) {
                Piece<N> piece = make(i);
                piece.hint = hint;
                evaluate(target_, piece);
                first[i] = {piece.upper, hint = piece.hint};
                distance[i] = piece.distance;
            }
        });
        queries_ += count;
        double sum = 0, measure = 0;
        for (std::size_t i = 0; i < count; ++i) {
            Piece<N> piece = make(i);
            const double m = measure_of(piece);
            measure += m;
            sum += m * distance[i] * distance[i];
            piece.distance = distance[i];
            attain(piece);
        }
        result_.rms = measure > 0 ? std::sqrt(sum / measure) : 0;
        return first;
    }

    /// Batches of fixed size, so that any number of threads gives the same; what was cut last comes first, or
    /// few large pieces over many small elements would be cut into more than fits.
    void refine(const std::vector<Piece<N>>& open) {
        PieceStack<N> pieces;
        for (const Piece<N>& piece : open) pieces.push(piece);
        std::vector<Piece<N>> batch, next;
        while (pieces.size() > 0) {
            if (queries_ >= options_.max_queries || context_.is_cancelled()) {
                result_.upper = std::max(result_.upper, pieces.largest_upper());
                return;
            }
            pieces.take(std::min(pieces.size(), kBatch), batch);
            next.clear();
            for (const Piece<N>& piece : batch) cut_further(piece, next);
            context_.parallel().for_each(next.size(), kChunk,
                                         [&](std::size_t i) { evaluate(target_, next[i]); });
            queries_ += next.size();
            for (const Piece<N>& piece : next) attain(piece);
            for (const Piece<N>& piece : next) pieces.push(piece);
        }
    }

    void cut_further(const Piece<N>& piece, std::vector<Piece<N>>& parts) {
        const double limit = enough();
        double bound = piece.upper;
        if (piece.upper > limit && piece.cuts < kMaxCutsInARow) {
            const std::size_t first = parts.size();
            bound = split(piece, target_, limit, parts);
            for (std::size_t i = first; i < parts.size(); ++i) parts[i].cuts = piece.cuts + 1;
        }
        result_.upper = std::max(result_.upper, bound);
    }

    DirectedDeviation result_;
    const BoundaryModel& target_;
    const DeviationOptions& options_;
    const Context& context_;
    std::size_t queries_ = 0;
};

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

DirectedDeviation measure_triangles(const BoundaryModel& from, bool by_source, DirectedDeviation attained,
                                    const BoundaryModel& target, const DeviationOptions& options,
                                    const Context& context) {
    return DirectedMeasure<3>(attained, target, options, context)
        .run(from.triangle_count(), [&](std::size_t i) {
            const auto t = static_cast<Index>(i);
            const auto& x = from.triangle(t);
            return Piece<3>{{x[0], x[1], x[2]},
                            3,
                            by_source ? from.source_face(t) : t,
                            kNoIndex,
                            0,
                            0,
                            std::numeric_limits<double>::infinity()};
        });
}

DirectedDeviation measure_segments(const BoundaryModel& from, const BoundaryModel& target,
                                   const DeviationOptions& options, const Context& context) {
    return DirectedMeasure<2>({}, target, options, context).run(from.segment_count(), [&](std::size_t i) {
        const auto s = static_cast<Index>(i);
        return Piece<2>{from.segment(s), 2, s, kNoIndex, 0, 0, std::numeric_limits<double>::infinity()};
    });
}

/// The mesh's boundary as one patch and its feature edges as a curve each.
BoundaryModel build_distance_model(const HexMesh& mesh, std::vector<Quad> quads,
                                   std::span<const std::array<Index, 2>> feature_edges, double tolerance,
                                   double& bilinear_gap) {
    BoundaryModelParts parts;
    parts.smooth = false;
    std::vector<Index> number(mesh.vertex_count(), kNoIndex);
    const auto number_of = [&](Index v) {
        if (number[v] == kNoIndex) {
            number[v] = static_cast<Index>(parts.vertices.size());
            parts.vertices.push_back(mesh.positions[v]);
        }
        return number[v];
    };
    parts.vertices.reserve(2 * quads.size() + 2 * feature_edges.size()); // with the quads' centres
    for (Quad& quad : quads)
        for (Index& v : quad) v = number_of(v);
    for (const auto& edge : feature_edges)
        for (Index v : edge) number_of(v);
    bilinear_gap = add_quads(quads, tolerance, parts);
    parts.patch.assign(parts.triangles.size(), 0);
    parts.patch_count = 1;
    for (const auto& edge : feature_edges) {
        for (Index v : edge) parts.curve_vertex.item.push_back(number[v]);
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
    std::vector<Quad> quads = boundary_quads(mesh, topology);
    Deviation result;
    const DirectedDeviation attained = measure_vertices(mesh, quads, model, context);
    const BoundaryModel moved = build_distance_model(mesh, std::move(quads), model.feature_edges(),
                                                     model.quad_tolerance(), result.bilinear_gap);
    result.diagonal = model.diagonal();
    result.mesh_to_surface = measure_triangles(moved, true, attained, model, options, context);
    result.surface_to_mesh = measure_triangles(model, false, {}, moved, options, context);
    if (model.segment_count() > 0 && moved.segment_count() > 0) {
        result.mesh_to_curves = measure_segments(moved, model, options, context);
        result.curves_to_mesh = measure_segments(model, moved, options, context);
    }
    result.within_tenth_h_pct = percentage_within_tenth(mesh.positions, boundary_quads(mesh, topology), model,
                                                        moved, context.parallel());
    result.largest_corner_distance = largest_corner_distance(mesh, model);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "deviation", "", "cancelled");
    return result;
}

} // namespace hexopt
