#include "domain/smooth_borders.hpp"

#include "domain/curve_segments.hpp"
#include "domain/surface_polygons.hpp"
#include "domain/turn_beside.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>

namespace hexopt {

namespace {

/// In cells: how far other lines have to stay away, and how far apart places are where that is looked at.
constexpr double kRoom = 4;
constexpr double kStep = 0.5;
/// Sine of the angle below which lines that meet leave no room between them (40 degrees).
constexpr double kAcute = 0.64;
constexpr double kMostSteps = 200;
/// In cells: how far from a border the surface has to have turned, by so many degrees on each side and in
/// all, along the larger part of it.
constexpr double kTurnReach = 0.5, kSideTurn = 15, kWholeTurn = 60;
/// In cells: what rounding may make of a distance of 0.
constexpr double kTie = 1e-6;

using Edge = std::array<Index, 2>;

Edge edge_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

std::vector<Edge> edges_of(std::span<const Index> chain) {
    std::vector<Edge> edges;
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) edges.push_back(edge_of(chain[i], chain[i + 1]));
    return edges;
}

std::set<Edge> collect_edges(const FeatureGraph& graph) {
    std::set<Edge> edges;
    for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c) {
        const std::vector<Edge> own = edges_of(graph.curve_vertex[c]);
        edges.insert(own.begin(), own.end());
    }
    return edges;
}

/// A place on a curve where it is looked at.
struct Place {
    Point point;
    double s;     ///< arc length
    double size;  ///< of the cells there; 0: none
    double share; ///< of the curve's length, of which it is the middle
    Edge edge;
};

std::vector<Place> places_on(std::span<const Index> chain, const std::vector<Point>& vertices,
                             const std::function<double(const Point&)>& cell_size) {
    std::vector<Place> places;
    double s = 0;
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
        const Point &a = vertices[chain[i]], &b = vertices[chain[i + 1]];
        const double length = glm::distance(a, b), size = cell_size(0.5 * (a + b));
        const double steps = size > 0 ? std::clamp(std::ceil(length / (kStep * size)), 1.0, kMostSteps) : 1;
        for (int k = 0; k < static_cast<int>(steps); ++k) {
            const double t = (k + 0.5) / steps;
            const Point p = glm::mix(a, b, t);
            places.push_back(
                {p, s + t * length, cell_size(p), length / steps, edge_of(chain[i], chain[i + 1])});
        }
        s += length;
    }
    for (Place& place : places) place.share /= s;
    return places;
}

/// Whether a border runs along a bend of the surface that is an edge to cells of this size, such as the nose
/// of a wing.
bool is_on_bend(std::span<const Place> places, const TurnBeside& surface) {
    double share = 0;
    for (const Place& at : places) {
        const auto [left, right] = surface.turn_deg(at.edge, at.point, kTurnReach * at.size);
        if (std::min(left, right) >= kSideTurn && left + right >= kWholeTurn) share += at.share;
    }
    return share > 0.5;
}

/// Where lines come near to one another, in cells of a given size.
class RoomBeside {
  public:
    RoomBeside(const CleanSurface& surface, const FeatureGraph& graph) : graph_(graph) {
        std::vector<Point> points;
        for (Index c = 0; c < graph.curve_vertex.rows(); ++c) {
            points.clear();
            for (Index v : graph.curve_vertex[c]) points.push_back(surface.vertices[v]);
            segments_.add_curve(points);
        }
        segments_.build_tree();
    }

    /// Whether there is room all along a curve.
    bool is_enough(Index curve, std::span<const Place> places) const {
        double largest = 0;
        for (const Place& at : places) {
            if (!(at.size > 0) || !is_enough(curve, at)) return false;
            largest = std::max(largest, at.size);
        }
        return segments_.length(curve) > kRoom * largest;
    }

  private:
    /// Whether no other line, and no other part of this one, is near a place of a curve: nearer than lines
    /// are that leave one of its ends under the smallest angle.
    bool is_enough(Index curve, const Place& at) const {
        const auto& [p, s, size, share, edge] = at;
        const double length = segments_.length(curve);
        const bool closed = graph_.closed[curve];
        const double to_end = closed ? length : std::min(s, length - s);
        const double most = kRoom * size;
        return !segments_.has_near(p, most, [&](const CurveSegment& other, const auto& closest) {
            double along = to_end;
            if (other.curve == curve) {
                along = std::abs(other.s + closest.weight[1] * glm::distance(other.end[0], other.end[1]) - s);
                if (closed) along = std::min(along, length - along);
            }
            return glm::distance(closest.point, p) < std::min(most, kAcute * along) - kTie * size;
        });
    }

    const FeatureGraph& graph_;
    CurveSegments segments_;
};

} // namespace

Result<SmoothBorders> find_smooth_borders(const TriangleSoup& surface, const BoundaryOptions& options,
                                          std::span<const std::array<Index, 2>> given,
                                          const std::function<double(const Point&)>& cell_size) {
    SmoothBorders found;
    if (surface.patch_group.empty() || !options.patch_borders) return found;
    const auto grouped = clean_surface(surface);
    if (!grouped) return grouped.error();
    const std::vector<Edge> merged = merge_edges(surface.vertices, given);
    const FeatureLimits limits = {options.feature_angle_deg, options.corner_turn_deg, true, merged};
    const std::set<Edge> strong =
        collect_edges(compute_feature_graph(grouped->vertices, grouped->polygons, limits));
    TriangleSoup faces = surface;
    faces.patch_group.clear(); // all borders count
    const auto clean = clean_surface(faces);
    if (!clean) return clean.error();
    const FeatureGraph all = compute_feature_graph(clean->vertices, clean->polygons, limits);
    const std::set<Edge> lines = collect_edges(all);
    const RoomBeside room(*clean, all);
    const TurnBeside turns(*clean, lines);
    for (Index c = 0; c < all.curve_vertex.rows(); ++c) {
        std::vector<Edge> smooth;
        for (const Edge& edge : edges_of(all.curve_vertex[c]))
            if (!strong.contains(edge)) smooth.push_back(edge);
        if (smooth.empty()) continue;
        const std::vector<Place> places = places_on(all.curve_vertex[c], clean->vertices, cell_size);
        if (!room.is_enough(c, places) || !is_on_bend(places, turns)) continue;
        ++found.count;
        found.edges.insert(found.edges.end(), smooth.begin(), smooth.end());
    }
    return found;
}

} // namespace hexopt
