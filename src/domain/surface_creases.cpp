#include "domain/surface_creases.hpp"

#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace hexopt {

namespace {

/// Part of a crease's turn that ends a flat face.
constexpr double kFlat = 1.0 / 3;
/// Triangles that a width is followed through at most.
constexpr int kMostSteps = 50;

double angle_between(const Point& a, const Point& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

class CreaseFinder {
  public:
    CreaseFinder(std::span<const Point> vertices, std::span<const std::array<Index, 3>> triangles,
                 std::span<const Point> normal)
        : x_(vertices), triangle_(triangles), normal_(normal),
          neighbour_(triangles.size(), {kNoIndex, kNoIndex, kNoIndex}) {
        collect_sides();
        for_each_pair([&](const Side& a, const Side& b) {
            neighbour_[a.triangle][a.edge] = b.triangle;
            neighbour_[b.triangle][b.edge] = a.triangle;
        });
    }

    std::vector<Crease> find(double least_turn, double farthest) const {
        std::vector<Crease> creases;
        for_each_pair([&](const Side& a, const Side& b) {
            const Point n = normal_[a.triangle], m = normal_[b.triangle];
            if (n == Point(0) || m == Point(0)) return;
            const double turn = angle_between(n, m);
            if (turn > least_turn)
                creases.push_back({{a.low, a.high},
                                   {a.triangle, b.triangle},
                                   turn,
                                   {width(a, kFlat * turn, farthest), width(b, kFlat * turn, farthest)}});
        });
        return creases;
    }

  private:
    struct Side {
        Index low, high, triangle;
        int edge; ///< from corner `edge` to the next
    };

    void collect_sides() {
        for (Index t = 0; t < triangle_.size(); ++t)
            for (int k = 0; k < 3; ++k) {
                const auto [low, high] = std::minmax(triangle_[t][k], triangle_[t][(k + 1) % 3]);
                side_.push_back({low, high, t, k});
            }
        std::sort(side_.begin(), side_.end(), [](const Side& a, const Side& b) {
            return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
        });
    }

    /// visit(side, side) for every edge of two triangles of like orientation.
    template <class Visit>
    void for_each_pair(const Visit& visit) const {
        for (std::size_t i = 0; i < side_.size();) {
            std::size_t end = i + 1;
            while (end < side_.size() && side_[end].low == side_[i].low && side_[end].high == side_[i].high)
                ++end;
            const auto starts_low = [&](const Side& s) { return triangle_[s.triangle][s.edge] == s.low; };
            if (end - i == 2 && starts_low(side_[i]) != starts_low(side_[i + 1]))
                visit(side_[i], side_[i + 1]);
            i = end;
        }
    }

    double width(const Side& side, double limit, double farthest) const {
        double least = farthest;
        for (double part : {0.25, 0.5, 0.75}) least = std::min(least, walk(side, part, limit, least));
        return least;
    }

    /// Unit vector in the plane of `normal` square to an edge, towards the triangle that has it.
    static Point inwards(const Point& normal, const Point& edge) {
        const Point across = glm::cross(normal, edge);
        const double length = glm::length(across);
        return length > 0 ? across / length : Point(0);
    }

    Point edge_of(Index t, int k) const { return x_[triangle_[t][(k + 1) % 3]] - x_[triangle_[t][k]]; }

    /// How far a straight line from a side goes over the surface.
    double walk(const Side& side, double part, double limit, double farthest) const {
        Index t = side.triangle;
        int entry = side.edge;
        const Point start = normal_[t];
        Point normal = start, at = x_[triangle_[t][entry]] + part * edge_of(t, entry);
        Point direction = inwards(normal, edge_of(t, entry));
        double length = 0;
        for (int step = 0; step < kMostSteps; ++step) {
            const auto [exit, distance] = find_exit(t, entry, normal, at, direction);
            if (exit < 0) return length;
            length += distance;
            if (length >= farthest) return farthest;
            const Index next = neighbour_[t][exit];
            if (next == kNoIndex) return length;
            const Point beyond = normal_[next] == Point(0) ? normal : normal_[next];
            if (angle_between(start, beyond) > limit) return length;
            const Point edge = edge_of(t, exit), along = edge / glm::length(edge);
            const Point out = -inwards(normal, edge);
            at += distance * direction;
            direction = glm::dot(direction, along) * along - glm::dot(direction, out) * inwards(beyond, edge);
            for (int k = 0; k < 3; ++k)
                if (neighbour_[next][k] == t && triangle_[next][k] == triangle_[t][(exit + 1) % 3]) entry = k;
            t = next;
            normal = beyond;
        }
        return length;
    }

    struct Exit {
        int edge; ///< -1: none
        double distance;
    };
    Exit find_exit(Index t, int entry, const Point& normal, const Point& at, const Point& direction) const {
        Exit best{-1, std::numeric_limits<double>::infinity()};
        for (int k = 0; k < 3; ++k) {
            if (k == entry) continue;
            const Point out = -inwards(normal, edge_of(t, k));
            const double speed = glm::dot(direction, out);
            if (!(speed > 1e-12)) continue;
            const double distance = std::max(0.0, glm::dot(x_[triangle_[t][k]] - at, out) / speed);
            if (distance < best.distance) best = {k, distance};
        }
        return best;
    }

    std::span<const Point> x_;
    std::span<const std::array<Index, 3>> triangle_;
    std::span<const Point> normal_;
    std::vector<std::array<Index, 3>> neighbour_; ///< of each edge of a triangle; kNoIndex without a like one
    std::vector<Side> side_;
};

} // namespace

double chord_distance(const Crease& crease, double size) {
    const double a = std::min(crease.width[0], 0.5 * size), b = std::min(crease.width[1], 0.5 * size);
    return a + b > 0 ? a * b / (a + b) * crease.turn : 0;
}

std::vector<Crease> find_creases(std::span<const Point> vertices,
                                 std::span<const std::array<Index, 3>> triangles,
                                 std::span<const Point> normal, double least_turn, double farthest) {
    return CreaseFinder(vertices, triangles, normal).find(least_turn, farthest);
}

PatchCreases find_patch_creases(const BoundaryModel& model, double least_turn, double farthest) {
    std::vector<Point> corners, normal;
    for (Index t = 0; t < model.triangle_count(); ++t) {
        const auto& x = model.triangle(t);
        corners.insert(corners.end(), x.begin(), x.end());
        const Point cross = glm::cross(x[1] - x[0], x[2] - x[0]);
        const double length = glm::length(cross);
        normal.push_back(length > 0 ? cross / length : Point(0));
    }
    const std::vector<Index> first = find_first_equal(corners);
    std::vector<std::array<Index, 3>> triangles;
    for (std::size_t t = 0; t < normal.size(); ++t)
        triangles.push_back({first[3 * t], first[3 * t + 1], first[3 * t + 2]});
    PatchCreases found{find_creases(corners, triangles, normal, least_turn, farthest), {}, {}};
    std::erase_if(found.crease, [&](const Crease& crease) {
        return model.patch_of_triangle(crease.triangle[0]) != model.patch_of_triangle(crease.triangle[1]);
    });
    std::vector<std::vector<Index>> at(normal.size());
    for (Index c = 0; c < found.crease.size(); ++c) {
        const Crease& crease = found.crease[c];
        found.ends.push_back({corners[crease.vertex[0]], corners[crease.vertex[1]]});
        for (Index t : crease.triangle) at[t].push_back(c);
    }
    for (const std::vector<Index>& creases : at) {
        auto& all = found.of_triangle;
        all.item.insert(all.item.end(), creases.begin(), creases.end());
        all.offset.push_back(all.item.size());
    }
    return found;
}

} // namespace hexopt
