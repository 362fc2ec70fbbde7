#include "domain/sampled_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 256;
constexpr double kTenth = 0.1;
/// Parameters of the places on a quad; each stands for a fifth of it.
constexpr std::array<std::array<double, 2>, 5> kPlaces = {
    {{0.25, 0.25}, {0.75, 0.25}, {0.5, 0.5}, {0.25, 0.75}, {0.75, 0.75}}};
/// Places on the surface for each quad.
constexpr double kPlacesPerQuad = 4;
/// Rows of a triangle, and places in a row, at most.
constexpr int kMostParts = 1000;

struct Area {
    double all = 0, within = 0;
    void add(double area, double distance, double size) {
        all += area;
        if (distance <= kTenth * size) within += area;
    }
};

Point bilinear(const std::array<Point, 4>& x, double u, double v) {
    return (1 - v) * ((1 - u) * x[0] + u * x[1]) + v * ((1 - u) * x[3] + u * x[2]);
}

double area_of(const std::array<Point, 3>& x) {
    return 0.5 * glm::length(glm::cross(x[1] - x[0], x[2] - x[0]));
}

class Sampler {
  public:
    Sampler(std::span<const Point> positions, std::span<const Quad> quads, const BoundaryModel& surface,
            const BoundaryModel& quad_surface)
        : positions_(positions), quads_(quads), surface_(surface), quad_surface_(quad_surface) {
        double area = 0;
        for (Index t = 0; t < surface.triangle_count(); ++t) area += area_of(surface.triangle(t));
        spacing_ = std::sqrt(area / (kPlacesPerQuad * static_cast<double>(quads.size())));
    }

    void visit_quad(Index q, Index& hint, Area& sum) const {
        const std::array<Point, 4> x = corners_of(q);
        const double area = 0.5 * glm::length(glm::cross(x[2] - x[0], x[3] - x[1]));
        for (const auto& [u, v] : kPlaces) {
            const Projection nearest = surface_.project_patch(kNoIndex, bilinear(x, u, v), hint);
            hint = nearest.element;
            sum.add(area / kPlaces.size(), nearest.distance, size_of(q));
        }
    }

    /// In rows along the longest side.
    void visit_triangle(Index t, Index& hint, Area& sum) const {
        const std::array<Point, 3>& x = surface_.triangle(t);
        const auto side = [&](int k) { return glm::distance(x[k], x[(k + 1) % 3]); };
        int longest = side(1) > side(0) ? 1 : 0;
        if (side(2) > side(longest)) longest = 2;
        const Point &a = x[longest], &b = x[(longest + 1) % 3], &apex = x[(longest + 2) % 3];
        const double base = side(longest), area = area_of(x);
        const int rows = count_parts(base > 0 ? 2 * area / base : 0);
        for (int row = 0; row < rows; ++row) {
            const double height = (row + 0.5) / rows; // of the whole
            const int places = count_parts((1 - height) * base);
            for (int k = 0; k < places; ++k) {
                const Point on_base = a + (k + 0.5) / places * (b - a);
                const Projection nearest =
                    quad_surface_.project_patch(kNoIndex, on_base + height * (apex - on_base), hint);
                hint = nearest.element;
                sum.add(2 * area * (1 - height) / rows / places, nearest.distance,
                        size_of(quad_surface_.source_face(nearest.element)));
            }
        }
    }

  private:
    std::array<Point, 4> corners_of(Index q) const {
        std::array<Point, 4> x;
        for (int k = 0; k < 4; ++k) x[k] = positions_[quads_[q][k]];
        return x;
    }

    double size_of(Index q) const {
        const std::array<Point, 4> x = corners_of(q);
        double sum = 0;
        for (int k = 0; k < 4; ++k) sum += glm::distance(x[k], x[(k + 1) % 4]);
        return sum / 4;
    }

    int count_parts(double length) const {
        if (!(spacing_ > 0)) return 1;
        return std::max(1, static_cast<int>(std::ceil(std::min(length / spacing_, double(kMostParts)))));
    }

    std::span<const Point> positions_;
    std::span<const Quad> quads_;
    const BoundaryModel& surface_;
    const BoundaryModel& quad_surface_;
    double spacing_ = 0;
};

template <class Visit>
Area sum_over(std::size_t count, const Parallel& parallel, const Visit& visit) {
    return parallel.reduce<Area>(
        count, kChunk, {},
        [&](std::size_t begin, std::size_t end) {
            Area sum;
            Index hint = kNoIndex; // neighbours in the list are neighbours in space
            for (std::size_t i = begin; i < end; ++i) visit(static_cast<Index>(i), hint, sum);
            return sum;
        },
        [](Area a, const Area& b) {
            return Area{a.all + b.all, a.within + b.within};
        });
}

} // namespace

double percentage_within_tenth(std::span<const Point> positions, std::span<const Quad> quads,
                               const BoundaryModel& surface, const BoundaryModel& quad_surface,
                               const Parallel& parallel) {
    if (quads.empty()) return 100;
    const Sampler sampler(positions, quads, surface, quad_surface);
    const Area on_quads = sum_over(
        quads.size(), parallel, [&](Index q, Index& hint, Area& sum) { sampler.visit_quad(q, hint, sum); });
    const Area on_surface =
        sum_over(surface.triangle_count(), parallel,
                 [&](Index t, Index& hint, Area& sum) { sampler.visit_triangle(t, hint, sum); });
    const double all = on_quads.all + on_surface.all;
    return all > 0 ? 100 * ((on_quads.within + on_surface.within) / all) : 100;
}

} // namespace hexopt
