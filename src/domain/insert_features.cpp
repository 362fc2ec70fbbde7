#include "domain/insert_features.hpp"

#include "domain/box_tree.hpp"
#include "domain/closest_point.hpp"
#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <optional>
#include <set>

namespace hexopt {

namespace {

using Triangle = std::array<Index, 3>;
using Edge = std::array<Index, 2>; ///< smaller vertex first

constexpr double kSnap_rel = 1e-5; ///< of the diagonal: digits that text files have lost
constexpr double kRounding_rel = 1e-12;
constexpr double kSnapShare = 0.02;        ///< of an edge: what is left of it would be a sliver
constexpr double kCrease_deg = 10;         ///< edges that lines are drawn to
constexpr std::size_t kMostSteps = 100000; ///< along one segment

Edge edge_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

std::string at_place(const Point& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

class FeatureInserter {
  public:
    FeatureInserter(const TriangleSoup& surface, double tolerance) : tolerance_(tolerance) {
        out_.soup = surface;
        const std::vector<Index> first = find_first_equal(surface.vertices);
        Box frame;
        for (Triangle& t : out_.soup.triangles)
            for (Index& v : t) frame.add(point(v = first[v]));
        diagonal_ = glm::distance(frame.low, frame.high);
        star_.resize(out_.soup.vertices.size());
        std::vector<Box> boxes(out_.soup.triangles.size());
        for (Index t = 0; t < boxes.size(); ++t)
            for (Index v : out_.soup.triangles[t]) {
                boxes[t].add(point(v));
                star_[v].push_back(t);
            }
        tree_ = BoxTree(frame);
        root_ = tree_.add_tree(boxes, 0, order_);
        find_creases();
    }

    Status insert(const FeatureLines& lines, const Context& context) {
        for (const auto& segment : lines.segments) {
            if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "features", "", "cancelled");
            std::array<Index, 2> ends{};
            for (std::size_t i = 0; i < 2; ++i) {
                const std::optional<Index> v = vertex_at(segment[i]);
                if (!v)
                    return refuse(lines, segment[i],
                                  fmt::format("a line is {:.3g} away from the surface",
                                              distance_to_surface(segment[i])));
                ends[i] = *v;
            }
            if (const std::optional<Point> lost = connect(ends[0], ends[1], segment))
                return refuse(lines, *lost,
                              fmt::format("the line from {} to {} leaves the surface", at_place(segment[0]),
                                          at_place(segment[1])));
        }
        return Done{};
    }

    FeaturedSurface take() {
        out_.edges.assign(features_.begin(), features_.end());
        return std::move(out_);
    }

  private:
    struct Nearest {
        Index triangle = kNoIndex;
        Point point = {};
        double distance = 0;
    };

    Error refuse(const FeatureLines& lines, const Point& p, std::string reason) const {
        return Error{ErrorCode::bad_input,
                     "features",
                     lines.file.empty() ? at_place(p) : lines.file + " near " + at_place(p),
                     {std::move(reason),
                      fmt::format("lines must lie within {:.3g} of it (--features-reach, of the diagonal)",
                                  tolerance_)}};
    }

    const Point& point(Index v) const { return out_.soup.vertices[v]; }
    Triangle& triangle(Index t) { return out_.soup.triangles[t]; }
    const Triangle& triangle(Index t) const { return out_.soup.triangles[t]; }
    Point normal(Index t) const {
        const auto& [a, b, c] = triangle(t);
        return glm::cross(point(b) - point(a), point(c) - point(a));
    }
    double snap() const { return kSnap_rel * diagonal_; }

    void find_creases() {
        std::map<Edge, std::vector<Index>> sides;
        for (Index t = 0; t < out_.soup.triangles.size(); ++t)
            for (std::size_t k = 0; k < 3; ++k)
                sides[edge_of(triangle(t)[k], triangle(t)[(k + 1) % 3])].push_back(t);
        for (const auto& [edge, beside] : sides) {
            bool is_crease = beside.size() != 2;
            if (!is_crease) {
                const Point n = normal(beside[0]), m = normal(beside[1]);
                is_crease = std::atan2(glm::length(glm::cross(n, m)), glm::dot(n, m)) >
                            kCrease_deg * std::numbers::pi / 180;
                if (!out_.soup.patch.empty())
                    is_crease = is_crease || out_.soup.group_of(out_.soup.patch[beside[0]]) !=
                                                 out_.soup.group_of(out_.soup.patch[beside[1]]);
            }
            if (is_crease) creases_.insert(edge);
        }
    }

    /// Triangles that an initial one has been cut into.
    void for_pieces(Index t, const auto& use) const {
        use(t);
        if (const auto found = pieces_.find(t); found != pieces_.end())
            for (Index piece : found->second) for_pieces(piece, use);
    }

    Nearest nearest(const Point& p) const {
        Nearest best;
        double best2 = std::numeric_limits<double>::max();
        tree_.visit_near(root_, p, best2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i)
                for_pieces(order_[i], [&](Index t) {
                    const auto& [a, b, c] = triangle(t);
                    const Point q = closest_on_triangle(p, point(a), point(b), point(c)).point;
                    const double d2 = glm::dot(q - p, q - p);
                    if (d2 > best2 || (d2 == best2 && t >= best.triangle)) return;
                    best2 = d2;
                    best = {t, q, std::sqrt(d2)};
                });
        });
        return best;
    }
    double distance_to_surface(const Point& p) const { return nearest(p).distance; }

    /// The nearest edge of those that lines are drawn to, within the tolerance.
    std::optional<Edge> nearest_crease(const Point& p) const {
        double best2 = tolerance_ * tolerance_;
        std::optional<Edge> best;
        tree_.visit_near(root_, p, best2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i)
                for_pieces(order_[i], [&](Index t) {
                    for (std::size_t k = 0; k < 3; ++k) {
                        const Edge edge = edge_of(triangle(t)[k], triangle(t)[(k + 1) % 3]);
                        if (!creases_.contains(edge)) continue;
                        const Point q = closest_on_segment(p, point(edge[0]), point(edge[1])).point;
                        const double d2 = glm::dot(q - p, q - p);
                        if (d2 > best2 || (d2 == best2 && best && edge >= *best)) continue;
                        best2 = d2;
                        best = edge;
                    }
                });
        });
        return best;
    }

    /// The vertex for a point of a line: one that is there, or a new one on an edge or in a triangle.
    std::optional<Index> vertex_at(const Point& p) {
        const Nearest at = nearest(p);
        if (!(at.distance <= tolerance_)) return std::nullopt;
        for (Index v : triangle(at.triangle))
            if (glm::distance(point(v), p) <= snap()) return v;
        if (const std::optional<Edge> crease = nearest_crease(p)) return vertex_on(*crease, p);
        std::optional<Edge> edge;
        double least = std::numeric_limits<double>::max();
        for (std::size_t k = 0; k < 3; ++k) {
            const Edge side = edge_of(triangle(at.triangle)[k], triangle(at.triangle)[(k + 1) % 3]);
            const double length = glm::distance(point(side[0]), point(side[1]));
            const Point q = closest_on_segment(at.point, point(side[0]), point(side[1])).point;
            const double away = glm::distance(at.point, q);
            if (away > std::max(snap(), kSnapShare * length) || away >= least) continue;
            edge = side;
            least = away;
        }
        return edge ? vertex_on(*edge, at.point) : split_triangle(at.triangle, at.point);
    }

    /// The end of an edge that p is next to, or a new vertex on it.
    Index vertex_on(const Edge& edge, const Point& p) {
        const auto closest = closest_on_segment(p, point(edge[0]), point(edge[1]));
        const double near = std::max(snap(), kSnapShare * glm::distance(point(edge[0]), point(edge[1])));
        for (Index v : edge)
            if (glm::distance(point(v), closest.point) <= near) return v;
        return split_edge(edge, closest.point);
    }

    Index add_vertex(const Point& p) {
        out_.soup.vertices.push_back(p);
        star_.emplace_back();
        return static_cast<Index>(out_.soup.vertices.size() - 1);
    }

    /// A new triangle, cut off from t.
    void add_piece(Index t, const Triangle& ids) {
        const auto piece = static_cast<Index>(out_.soup.triangles.size());
        out_.soup.triangles.push_back(ids);
        if (!out_.soup.patch.empty()) out_.soup.patch.push_back(out_.soup.patch[t]);
        for (Index v : ids) star_[v].push_back(piece);
        pieces_[t].push_back(piece);
        ++out_.cut_triangles;
    }

    void replace(Index t, std::size_t k, Index by) {
        std::erase(star_[triangle(t)[k]], t);
        triangle(t)[k] = by;
        star_[by].push_back(t);
    }

    Index split_triangle(Index t, const Point& p) {
        const Index m = add_vertex(p);
        const auto [a, b, c] = triangle(t);
        add_piece(t, {b, c, m});
        add_piece(t, {c, a, m});
        replace(t, 2, m);
        return m;
    }

    Index split_edge(const Edge& edge, const Point& p) {
        const Index m = add_vertex(p);
        for (Index t : triangles_at(edge)) {
            std::size_t k = 0; // the edge runs from corner k to the next
            while (edge_of(triangle(t)[k], triangle(t)[(k + 1) % 3]) != edge) ++k;
            const Index b = triangle(t)[(k + 1) % 3], c = triangle(t)[(k + 2) % 3];
            add_piece(t, {m, b, c});
            replace(t, (k + 1) % 3, m);
        }
        for (std::set<Edge>* set : {&creases_, &features_})
            if (set->erase(edge) > 0) {
                set->insert(edge_of(edge[0], m));
                set->insert(edge_of(edge[1], m));
            }
        return m;
    }

    std::vector<Index> triangles_at(const Edge& edge) const {
        std::vector<Index> both;
        for (Index t : star_[edge[0]])
            if (std::find(triangle(t).begin(), triangle(t).end(), edge[1]) != triangle(t).end())
                both.push_back(t);
        return both;
    }

    /// Makes the way from u to v one of edges near the segment; returns where that fails.
    std::optional<Point> connect(Index u, Index v, const std::array<Point, 2>& segment) {
        const Point to = point(v);
        const auto is_on_line = [&](const Point& p, double within) {
            return glm::distance(p, closest_on_segment(p, segment[0], segment[1]).point) <= within;
        };
        Index at = u;
        for (std::size_t step = 0; at != v; ++step) {
            Index next = next_along(at, v, is_on_line);
            if (next == kNoIndex) next = next_across(at, v);
            if (next == kNoIndex || step == kMostSteps || !is_on_line(point(next), tolerance_) ||
                !(glm::distance(point(next), to) < glm::distance(point(at), to)))
                return point(at);
            features_.insert(edge_of(at, next));
            at = next;
        }
        return std::nullopt;
    }

    /// The neighbour that the line passes: its end, else along a crease, else by the edge that follows it.
    Index next_along(Index at, Index v, const auto& is_on_line) const {
        Index best = kNoIndex;
        double best_distance = 0;
        bool best_crease = false;
        for (Index t : star_[at])
            for (Index w : triangle(t)) {
                if (w == at) continue;
                if (w == v) return v;
                const double distance = glm::distance(point(w), point(v));
                if (!(distance < glm::distance(point(at), point(v)))) continue;
                const bool crease = creases_.contains(edge_of(at, w));
                if (!is_on_line(point(w), crease ? tolerance_ : snap())) continue;
                const bool better = best == kNoIndex || crease > best_crease ||
                                    (crease == best_crease &&
                                     (distance < best_distance || (distance == best_distance && w < best)));
                if (!better) continue;
                best = w;
                best_distance = distance;
                best_crease = crease;
            }
        return best;
    }

    /// Where a way to v leaves the triangles round `at`.
    struct Exit {
        Edge edge = {};
        Point point = {};
        double cosine = 0; ///< of the angle with the way straight to v

        void offer(const Edge& on, const Point& from, const Point& way, const Point& straight) {
            const double size = glm::length(way) * glm::length(straight);
            const double c = size > 0 ? glm::dot(way, straight) / size : 0;
            if (c > cosine) *this = {on, from + way, c};
        }
    };

    /// The way on across a triangle, to a vertex on the edge opposite, made where needed; along an edge at
    /// most as far as it leads nearer to v, where no triangle lies that way (at tips).
    Index next_across(Index at, Index v) {
        const Point from = point(at), d = point(v) - from;
        Exit across, along;
        for (Index t : star_[at]) {
            std::size_t k = 0;
            while (triangle(t)[k] != at) ++k;
            const Index a = triangle(t)[(k + 1) % 3], b = triangle(t)[(k + 2) % 3];
            const Point x = point(a) - from, y = point(b) - from;
            const double xx = glm::dot(x, x), xy = glm::dot(x, y), yy = glm::dot(y, y);
            const double determinant = xx * yy - xy * xy;
            if (!(determinant > 0)) continue;
            const double p = (yy * glm::dot(x, d) - xy * glm::dot(y, d)) / determinant;
            const double q = (xx * glm::dot(y, d) - xy * glm::dot(x, d)) / determinant;
            if (p >= 0 && q >= 0 && p + q > 0)
                across.offer(edge_of(a, b), from, (p * x + q * y) / (p + q), d);
            along.offer(edge_of(at, a), from, std::clamp(glm::dot(x, d) / xx, 0.0, 1.0) * x, d);
            along.offer(edge_of(at, b), from, std::clamp(glm::dot(y, d) / yy, 0.0, 1.0) * y, d);
        }
        const Exit& exit = across.cosine > 0 ? across : along;
        return exit.cosine > 0 ? vertex_nearer(exit, at, v) : kNoIndex;
    }

    /// The vertex at an exit: an end of its edge that is next to it and nearer to v, else a new one.
    Index vertex_nearer(const Exit& exit, Index at, Index v) {
        const double length = glm::distance(point(exit.edge[0]), point(exit.edge[1]));
        for (Index end : exit.edge) {
            const double away = glm::distance(point(end), exit.point);
            const bool is_nearer = glm::distance(point(end), point(v)) < glm::distance(point(at), point(v));
            if (away <= kRounding_rel * diagonal_) return end;
            if (is_nearer && away <= std::max(snap(), kSnapShare * length)) return end;
        }
        return split_edge(exit.edge, exit.point);
    }

    double tolerance_;
    FeaturedSurface out_;
    double diagonal_ = 0;
    std::vector<std::vector<Index>> star_; ///< per vertex: its triangles
    BoxTree tree_;                         ///< of the triangles given
    Index root_ = kNoIndex;
    std::vector<Index> order_;
    std::map<Index, std::vector<Index>> pieces_; ///< what was cut off from a triangle
    std::set<Edge> creases_, features_;
};

} // namespace

Result<FeaturedSurface> insert_features(const TriangleSoup& surface, std::span<const FeatureLines> lines,
                                        double tolerance, Context& context) {
    if (Status ok = check_soup(surface); !ok) return ok.error();
    if (surface.triangles.empty())
        return make_error(ErrorCode::bad_input, "features", "", "the surface has no triangles");
    FeatureInserter inserter(surface, tolerance);
    for (const FeatureLines& file : lines)
        if (Status ok = inserter.insert(file, context); !ok) return ok.error();
    return inserter.take();
}

} // namespace hexopt
