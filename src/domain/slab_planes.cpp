#include "domain/slab_planes.hpp"

#include "domain/box_tree.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <tuple>

namespace hexopt {

namespace {

/// Eigenvectors of a symmetric matrix, as columns, by rising eigenvalue. Jacobi's rotations.
glm::dmat3 eigenvectors(glm::dmat3 m) {
    glm::dmat3 vectors(1);
    for (int sweep = 0; sweep < 20; ++sweep)
        for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
            if (m[p][q] == 0) continue;
            const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
            const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::hypot(theta, 1));
            const double c = 1 / std::hypot(t, 1), s = t * c;
            glm::dmat3 turn(1);
            turn[p][p] = turn[q][q] = c;
            turn[q][p] = s;
            turn[p][q] = -s;
            m = glm::transpose(turn) * m * turn;
            vectors = vectors * turn;
        }
    std::array<int, 3> order = {0, 1, 2};
    std::sort(order.begin(), order.end(), [&m](int a, int b) { return m[a][a] < m[b][b]; });
    return {vectors[order[0]], vectors[order[1]], vectors[order[2]]};
}

/// Heights of points along a direction, in two groups: below their middle and above.
struct Groups {
    Box low, high; ///< x alone is used: bounds of the heights
    double thickness() const { return high.high.x - low.low.x; }
    double spread() const { return std::max(low.high.x - low.low.x, high.high.x - high.low.x); }
};

class PlaneFinder {
  public:
    PlaneFinder(const TriangleSoup& surface, double most_rel) : surface_(surface) {
        std::vector<std::uint8_t> used(surface.vertices.size(), 0);
        for (const auto& t : surface.triangles)
            for (Index v : t) used[v] = 1;
        for (std::size_t v = 0; v < used.size(); ++v)
            if (used[v]) points_.push_back(surface.vertices[v]);
        for (const Point& p : points_) box_.add(p);
        diagonal_ = points_.empty() ? 0 : glm::distance(box_.low, box_.high);
        tolerance_ = kSlabRounding_rel * diagonal_;
        most_ = most_rel * diagonal_;
    }

    std::vector<SlabPlanes> find() {
        for (int axis : {2, 0, 1}) add_across(axis);
        for (const Point& normal : guess_normals()) add_turned(normal);
        std::stable_sort(found_.begin(), found_.end(),
                         [this](const SlabPlanes& a, const SlabPlanes& b) { return key(a) < key(b); });
        return std::move(found_);
    }

  private:
    std::tuple<bool, bool, double> key(const SlabPlanes& planes) const {
        const double thickness = planes.high - planes.low;
        return {thickness > kThinSlab_rel * diagonal_, !planes.frame.axis().has_value(), thickness};
    }

    void add_across(int axis) {
        const double low = box_.low[axis], high = box_.high[axis];
        if (!(high - low > 10 * tolerance_) || high - low > most_) return;
        const bool fits = std::all_of(points_.begin(), points_.end(), [&](const Point& p) {
            return p[axis] - low <= tolerance_ || high - p[axis] <= tolerance_;
        });
        if (fits) found_.push_back({PlaneFrame::across(axis), low, high});
    }

    /// Sides of a slab are across its normal, all walls along it: it is an eigenvector of the sum of
    /// n n^T over the surface. Where two of these are equally large, it is that of the widest triangle.
    std::vector<Point> guess_normals() const {
        glm::dmat3 sum(0);
        Point widest(0);
        double width = 0;
        for (const auto& t : surface_.triangles) {
            const Point &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
                        &c = surface_.vertices[t[2]];
            const Point normal = glm::cross(b - a, c - a);
            const double twice = glm::length(normal);
            if (!(twice > 0)) continue;
            for (int k = 0; k < 3; ++k) sum[k] += normal[k] / twice * normal;
            const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
            if (twice / longest > width) {
                width = twice / longest;
                widest = normal / twice;
            }
        }
        if (!(width > 0)) return {};
        const glm::dmat3 main = eigenvectors(sum / (diagonal_ * diagonal_));
        return {main[2], widest, main[1], main[0]};
    }

    Groups group(const Point& normal) const {
        Box all;
        for (const Point& p : points_) all.add(Point(glm::dot(normal, p)));
        Groups groups;
        const double middle = all.centre().x;
        for (const Point& p : points_) {
            const double height = glm::dot(normal, p);
            (height < middle ? groups.low : groups.high).add(Point(height));
        }
        return groups;
    }

    /// Least squares: across both groups.
    Point fit_normal(const Point& normal, double middle) const {
        std::array<Point, 2> centre = {Point(0), Point(0)};
        std::array<double, 2> count = {0, 0};
        const auto side = [&](const Point& p) { return glm::dot(normal, p) < middle ? 0 : 1; };
        for (const Point& p : points_) {
            centre[side(p)] += p - box_.low;
            count[side(p)] += 1;
        }
        for (int s = 0; s < 2; ++s) centre[s] = box_.low + centre[s] / std::max(count[s], 1.0);
        glm::dmat3 sum(0);
        for (const Point& p : points_) {
            const Point from = (p - centre[side(p)]) / diagonal_;
            for (int k = 0; k < 3; ++k) sum[k] += from[k] * from;
        }
        return eigenvectors(sum)[0];
    }

    void add_turned(Point normal) {
        for (const SlabPlanes& planes : found_)
            if (std::abs(glm::dot(planes.frame.normal(), normal)) > 0.5) return;
        Groups groups = group(normal);
        constexpr double kLoose = 0.3; // of the thickness: how far a guess may be off
        if (groups.thickness() > most_ * (1 + kLoose) || groups.spread() > kLoose * groups.thickness())
            return;
        for (int round = 0; round < 3; ++round) {
            normal = fit_normal(normal, (groups.low.low.x + groups.high.high.x) / 2);
            groups = group(normal);
        }
        const int main = std::abs(normal.x) >= std::abs(normal.y) && std::abs(normal.x) >= std::abs(normal.z)
                             ? 0
                         : std::abs(normal.y) >= std::abs(normal.z) ? 1
                                                                    : 2;
        if (normal[main] < 0) {
            normal = -normal;
            groups = group(normal);
        }
        const double low = groups.low.centre().x, high = groups.high.centre().x;
        if (groups.spread() > 2 * tolerance_ || !(high - low > 10 * tolerance_) || high - low > most_) return;
        const Point along = longest_wall_edge(normal, (low + high) / 2);
        if (along == Point(0)) return;
        const Point u = glm::normalize(along - glm::dot(along, normal) * normal);
        found_.push_back({PlaneFrame::turned({u, glm::cross(normal, u), normal}), low, high});
    }

    /// Of the edges in which walls end; zero where there are no walls. What is left of a straight side in
    /// many short edges has the direction of their sum.
    Point longest_wall_edge(const Point& normal, double middle) const {
        Point longest(0);
        visit_wall_edges(normal, middle, [&](const Point& edge) {
            if (glm::dot(edge, edge) > glm::dot(longest, longest)) longest = edge;
        });
        if (longest == Point(0)) return longest;
        const Point along = glm::normalize(longest);
        Point sum(0);
        visit_wall_edges(normal, middle, [&](const Point& edge) {
            const double part = glm::dot(edge, along);
            if (glm::length(edge - part * along) <= tolerance_) sum += part < 0 ? -edge : edge;
        });
        return sum;
    }

    template <class Visit>
    void visit_wall_edges(const Point& normal, double middle, const Visit& visit) const {
        const auto is_high = [&](Index v) { return glm::dot(normal, surface_.vertices[v]) >= middle; };
        for (const auto& t : surface_.triangles)
            for (int k = 0; k < 3; ++k) {
                const Index a = t[k], b = t[(k + 1) % 3];
                if (is_high(a) == is_high(b) && is_high(a) != is_high(t[(k + 2) % 3]))
                    visit(surface_.vertices[b] - surface_.vertices[a]);
            }
    }

    const TriangleSoup& surface_;
    std::vector<Point> points_;
    std::vector<SlabPlanes> found_;
    Box box_;
    double diagonal_ = 0, tolerance_ = 0, most_ = 0;
};

} // namespace

std::vector<SlabPlanes> find_slab_planes(const TriangleSoup& surface, double most_rel) {
    return PlaneFinder(surface, most_rel).find();
}

} // namespace hexopt
