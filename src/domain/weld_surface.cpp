#include "domain/weld_surface.hpp"

#include "core/union_find.hpp"
#include "domain/box_tree.hpp"
#include "domain/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

using Triangle = std::array<Index, 3>;
using Edge = std::array<Index, 2>; ///< in the direction of its triangle

constexpr const char* kStage = "weld";
constexpr int kMaxRounds = 8;
/// Open edges are joined as a whole where both ends are within so many tolerances and so much of the shorter
/// one of those of another.
constexpr double kPairReach = 10, kPairShare = 0.3;

Status check(const TriangleSoup& soup, double tolerance) {
    if (!(tolerance >= 0))
        return make_error(ErrorCode::usage, kStage, "", "the tolerance must not be negative");
    for (std::size_t v = 0; v < soup.vertices.size(); ++v)
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(soup.vertices[v][k]))
                return make_error(ErrorCode::bad_input, kStage, fmt::format("vertex {}", v),
                                  "a coordinate is not finite");
    for (std::size_t t = 0; t < soup.triangles.size(); ++t)
        for (Index v : soup.triangles[t])
            if (v >= soup.vertices.size())
                return make_error(ErrorCode::bad_input, kStage, fmt::format("triangle {}", t),
                                  fmt::format("vertex {} of {} does not exist", v, soup.vertices.size()));
    return Done{};
}

struct OpenEdge {
    Edge edge;
    Index triangle;
    int side; ///< from corner `side` of the triangle to the next
};

class Welder {
  public:
    Welder(const TriangleSoup& soup, double tolerance) : tolerance_(tolerance) {
        out_.soup = soup;
        merge_equal();
        out_.report.dropped_triangles += drop_collapsed();
    }

    WeldedSurface run(const Context& context) {
        out_.report.open_edges_before = find_open().size();
        out_.report.dropped_triangles += drop_flaps();
        std::vector<OpenEdge> open = find_open();
        for (int round = 0; round < kMaxRounds && !open.empty() && !context.is_cancelled(); ++round) {
            const std::size_t joined = join_edges(open);
            if (joined == 0) break;
            out_.report.merged_vertices += joined;
            out_.report.dropped_triangles += drop_collapsed();
            open = find_open();
        }
        for (int round = 0; round < kMaxRounds && !open.empty() && !context.is_cancelled(); ++round) {
            const std::size_t merged = merge_near(open);
            out_.report.merged_vertices += merged;
            if (merged > 0) out_.report.dropped_triangles += drop_collapsed();
            const std::size_t cut = cut_at_vertices(find_open());
            out_.report.cut_triangles += cut;
            open = find_open();
            if (merged + cut == 0) break;
        }
        out_.report.open_edges_after = open.size();
        return std::move(out_);
    }

  private:
    void merge_equal() {
        std::vector<Index> order(out_.soup.vertices.size()), first(order.size());
        std::iota(order.begin(), order.end(), Index{0});
        const std::vector<Point>& x = out_.soup.vertices;
        std::sort(order.begin(), order.end(), [&](Index a, Index b) {
            for (int k = 0; k < 3; ++k)
                if (x[a][k] != x[b][k]) return x[a][k] < x[b][k];
            return a < b;
        });
        for (std::size_t i = 0; i < order.size(); ++i)
            first[order[i]] = i > 0 && x[order[i]] == x[order[i - 1]] ? first[order[i - 1]] : order[i];
        for (Triangle& t : out_.soup.triangles)
            for (Index& v : t) v = first[v];
    }

    std::size_t drop_collapsed() {
        TriangleSoup& soup = out_.soup;
        std::size_t kept = 0;
        for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
            const Triangle& c = soup.triangles[t];
            if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
            soup.triangles[kept] = c;
            if (!soup.patch.empty()) soup.patch[kept] = soup.patch[t];
            ++kept;
        }
        const std::size_t dropped = soup.triangles.size() - kept;
        soup.triangles.resize(kept);
        if (!soup.patch.empty()) soup.patch.resize(kept);
        return dropped;
    }

    /// All triangles' sides, those of one edge together.
    std::vector<OpenEdge> sort_sides() const {
        std::vector<OpenEdge> all;
        for (Index t = 0; t < out_.soup.triangles.size(); ++t)
            for (int k = 0; k < 3; ++k)
                all.push_back({{out_.soup.triangles[t][k], out_.soup.triangles[t][(k + 1) % 3]}, t, k});
        std::sort(all.begin(), all.end(), [&](const OpenEdge& a, const OpenEdge& b) {
            const auto ka = key(a), kb = key(b);
            return ka != kb ? ka < kb : a.triangle < b.triangle;
        });
        return all;
    }
    static std::array<Index, 2> key(const OpenEdge& e) {
        const auto [low, high] = std::minmax(e.edge[0], e.edge[1]);
        return {low, high};
    }

    /// visit(first, last) for the sides of each edge.
    template <class Visit>
    static void for_each_edge(const std::vector<OpenEdge>& sides, const Visit& visit) {
        for (std::size_t i = 0; i < sides.size();) {
            std::size_t end = i + 1;
            while (end < sides.size() && key(sides[end]) == key(sides[i])) ++end;
            visit(i, end);
            i = end;
        }
    }

    std::vector<OpenEdge> find_open() const {
        const std::vector<OpenEdge> sides = sort_sides();
        std::vector<OpenEdge> open;
        for_each_edge(sides, [&](std::size_t first, std::size_t last) {
            if (last == first + 1) open.push_back(sides[first]);
        });
        return open;
    }

    /// Drops triangles no higher than the tolerance that hang on an edge that has two others: collapsed ones
    /// laid upon a surface that is whole without them.
    std::size_t drop_flaps() {
        const std::vector<OpenEdge> sides = sort_sides();
        std::vector<std::array<std::size_t, 3>> uses(out_.soup.triangles.size());
        for_each_edge(sides, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) uses[sides[i].triangle][sides[i].side] = last - first;
        });
        for (Index t = 0; t < uses.size(); ++t) {
            const int base = longest_side(t);
            if (uses[t][base] > 2 && uses[t][(base + 1) % 3] == 1 && uses[t][(base + 2) % 3] == 1 &&
                height(t, base) <= tolerance_)
                out_.soup.triangles[t] = {0, 0, 0};
        }
        return drop_collapsed();
    }

    int longest_side(Index t) const {
        const Triangle& v = out_.soup.triangles[t];
        std::array<double, 3> length;
        for (int k = 0; k < 3; ++k)
            length[k] = glm::distance(out_.soup.vertices[v[k]], out_.soup.vertices[v[(k + 1) % 3]]);
        return static_cast<int>(std::max_element(length.begin(), length.end()) - length.begin());
    }
    double height(Index t, int side) const {
        const Triangle& v = out_.soup.triangles[t];
        const Point apex = out_.soup.vertices[v[(side + 2) % 3]];
        return glm::distance(
            apex, closest_on_segment(apex, out_.soup.vertices[v[side]], out_.soup.vertices[v[(side + 1) % 3]])
                      .point);
    }

    /// The vertices of open edges, to be found by place.
    struct OpenVertices {
        std::vector<Index> vertex; ///< rising
        BoxTree tree;
        Index root;
        std::vector<Index> order; ///< item of the tree to place in `vertex`

        /// visit(vertex) for all within sqrt(reach2) of a point, and some more.
        template <class Visit>
        void visit_near(const Point& x, const double& reach2, const Visit& visit) const {
            tree.visit_near(root, x, reach2, [&](Index first, Index last) {
                for (Index i = first; i < last; ++i) visit(vertex[order[i]]);
            });
        }
    };

    OpenVertices collect_vertices(const std::vector<OpenEdge>& open) const {
        OpenVertices found;
        std::vector<Index>& vertices = found.vertex;
        for (const OpenEdge& e : open) vertices.insert(vertices.end(), e.edge.begin(), e.edge.end());
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        std::vector<Box> boxes(vertices.size());
        Box frame;
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            boxes[i].add(out_.soup.vertices[vertices[i]]);
            frame.add(boxes[i]);
        }
        found.tree = BoxTree(frame);
        found.root = found.tree.add_tree(boxes, 0, found.order);
        return found;
    }

    /// How far apart the ends of two edges are, in the order that has them nearer.
    struct Apart {
        double distance;
        bool is_reversed;
    };
    Apart measure_apart(const Edge& e, const Edge& f) const {
        const auto far = [&](Index a, Index b, Index c, Index d) {
            const std::vector<Point>& x = out_.soup.vertices;
            return std::max(glm::distance(x[a], x[b]), glm::distance(x[c], x[d]));
        };
        const double along = far(e[0], f[0], e[1], f[1]), against = far(e[0], f[1], e[1], f[0]);
        return {std::min(along, against), against <= along};
    }

    /// Joins open edges that are nearest to one another, farther apart than single vertices are merged.
    std::size_t join_edges(const std::vector<OpenEdge>& open) {
        const double reach = kPairReach * tolerance_;
        std::vector<Box> boxes(open.size());
        Box frame;
        const auto middle = [&](const OpenEdge& e) {
            return 0.5 * (out_.soup.vertices[e.edge[0]] + out_.soup.vertices[e.edge[1]]);
        };
        for (std::size_t i = 0; i < open.size(); ++i) boxes[i].add(middle(open[i])), frame.add(boxes[i]);
        std::vector<Index> order;
        BoxTree tree(frame);
        const Index root = tree.add_tree(boxes, 0, order);
        const auto length = [&](Index i) {
            return glm::distance(out_.soup.vertices[open[i].edge[0]], out_.soup.vertices[open[i].edge[1]]);
        };
        std::vector<Index> partner(open.size(), kNoIndex);
        for (Index i = 0; i < open.size(); ++i) {
            double best = std::min(reach, kPairShare * length(i));
            tree.visit_near(root, middle(open[i]), reach * reach, [&](Index first, Index last) {
                for (Index k = first; k < last; ++k) {
                    const Index j = order[k];
                    if (open[j].triangle == open[i].triangle) continue;
                    const double apart = measure_apart(open[i].edge, open[j].edge).distance;
                    if (apart < best && apart <= kPairShare * length(j)) best = apart, partner[i] = j;
                }
            });
        }
        UnionFind groups(out_.soup.vertices.size());
        std::size_t merged = 0;
        for (Index i = 0; i < open.size(); ++i) {
            const Index j = partner[i];
            if (j == kNoIndex || j < i || partner[j] != i) continue;
            const Edge &e = open[i].edge, &f = open[j].edge;
            const bool reversed = measure_apart(e, f).is_reversed;
            for (int k = 0; k < 2; ++k) merged += join(groups, e[k], f[reversed ? 1 - k : k], e, f);
        }
        take_means(groups);
        return merged;
    }

    /// Makes one vertex of each group, in the middle of its triangles' corners.
    void take_means(UnionFind& groups) {
        std::vector<Point>& x = out_.soup.vertices;
        std::vector<std::uint8_t> is_joined(x.size(), 0);
        for (Index v = 0; v < x.size(); ++v)
            if (groups.find(v) != v) is_joined[groups.find(v)] = 1;
        std::vector<Point> sum(x.size(), Point(0));
        std::vector<double> count(x.size(), 0);
        for (Triangle& t : out_.soup.triangles)
            for (Index& v : t) {
                const Index group = groups.find(v);
                sum[group] += x[v];
                count[group] += 1;
                v = group;
            }
        for (Index v = 0; v < x.size(); ++v)
            if (is_joined[v] && count[v] > 0) x[v] = sum[v] / count[v];
    }

    /// 0 where the ends are together or an edge would collapse.
    static std::size_t join(UnionFind& groups, Index a, Index b, const Edge& e, const Edge& f) {
        const Index low = groups.find(a), high = groups.find(b);
        if (low == high) return 0;
        for (const Edge& edge : {e, f}) {
            const Index from = groups.find(edge[0]), to = groups.find(edge[1]);
            if ((from == low && to == high) || (from == high && to == low)) return 0;
        }
        groups.join(a, b);
        return 1;
    }

    /// Moves each open vertex onto the lowest-numbered one within the tolerance that stays where it is.
    std::size_t merge_near(const std::vector<OpenEdge>& open) {
        const OpenVertices near = collect_vertices(open);
        std::vector<Index> target(out_.soup.vertices.size());
        std::iota(target.begin(), target.end(), Index{0});
        std::size_t merged = 0;
        const double reach2 = tolerance_ * tolerance_;
        for (Index v : near.vertex) {
            const Point& x = out_.soup.vertices[v];
            Index best = v;
            near.visit_near(x, reach2, [&](Index u) {
                const Point d = out_.soup.vertices[u] - x;
                if (u < best && target[u] == u && glm::dot(d, d) <= reach2) best = u;
            });
            if (best == v) continue;
            target[v] = best;
            ++merged;
        }
        for (Triangle& t : out_.soup.triangles)
            for (Index& v : t) v = target[v];
        return merged;
    }

    /// Cuts each triangle at the vertices that lie on one of its open edges.
    std::size_t cut_at_vertices(const std::vector<OpenEdge>& open) {
        if (open.empty()) return 0;
        const OpenVertices near = collect_vertices(open);
        std::vector<std::uint8_t> done(out_.soup.triangles.size(), 0);
        std::size_t cut = 0;
        for (const OpenEdge& e : open) {
            if (done[e.triangle]) continue; // its other edges come in the next round
            const std::vector<Index> on = vertices_on(e, near);
            if (on.empty()) continue;
            done[e.triangle] = 1;
            ++cut;
            cut_triangle(e, on);
        }
        return cut;
    }

    /// Vertices within the tolerance of an edge's inside, from its start to its end.
    std::vector<Index> vertices_on(const OpenEdge& e, const OpenVertices& near) const {
        const Point a = out_.soup.vertices[e.edge[0]], b = out_.soup.vertices[e.edge[1]];
        const Triangle& t = out_.soup.triangles[e.triangle];
        const double half = 0.5 * glm::distance(a, b) + tolerance_, reach2 = half * half;
        std::vector<std::pair<double, Index>> on;
        near.visit_near(0.5 * (a + b), reach2, [&](Index v) {
            if (std::find(t.begin(), t.end(), v) != t.end()) return;
            const Point& x = out_.soup.vertices[v];
            const ClosestPoint<2> at = closest_on_segment(x, a, b);
            if (at.weight[0] > 0 && at.weight[1] > 0 && glm::distance(x, at.point) <= tolerance_)
                on.emplace_back(at.weight[1], v);
        });
        std::sort(on.begin(), on.end());
        std::vector<Index> result;
        for (const auto& [at, v] : on) result.push_back(v);
        return result;
    }

    void cut_triangle(const OpenEdge& e, const std::vector<Index>& on) {
        TriangleSoup& soup = out_.soup;
        const Index apex = soup.triangles[e.triangle][(e.side + 2) % 3];
        Index from = e.edge[0];
        for (Index v : on) {
            soup.triangles.push_back({from, v, apex});
            if (!soup.patch.empty()) soup.patch.push_back(Index{soup.patch[e.triangle]});
            from = v;
        }
        soup.triangles[e.triangle] = {from, e.edge[1], apex};
    }

    double tolerance_;
    WeldedSurface out_;
};

} // namespace

Result<WeldedSurface> weld_surface(const TriangleSoup& soup, double tolerance, Context& context) {
    if (Status ok = check(soup, tolerance); !ok) return ok.error();
    WeldedSurface welded = Welder(soup, tolerance).run(context);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    return welded;
}

} // namespace hexopt
