#include "stages/refine/outer_box.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kCovered = 0.8;
constexpr int kMostReached = 2;

using Sides = std::array<bool, 6>; ///< planes x low, x high, y low, ...

class SideFinder {
  public:
    explicit SideFinder(const BoundaryModel& model) : model_(model), tolerance_(1e-6 * model.diagonal()) {
        for (Index t = 0; t < model.triangle_count(); ++t)
            for (const Point& p : model.triangle(t)) box_.add(p);
    }
    const Box& box() const { return box_; }

    /// Planes in which a triangle lies (`all`), or that any of its corners is on.
    Sides sides_of(Index triangle, bool all) const {
        Sides sides;
        sides.fill(all);
        for (const Point& p : model_.triangle(triangle))
            for (int s = 0; s < 6; ++s) {
                const double plane = s % 2 ? box_.high[s / 2] : box_.low[s / 2];
                const bool on = std::abs(p[s / 2] - plane) <= tolerance_;
                sides[s] = all ? sides[s] && on : sides[s] || on;
            }
        return sides;
    }

    double area_of(Index triangle) const {
        const auto& x = model_.triangle(triangle);
        return glm::length(glm::cross(x[1] - x[0], x[2] - x[0])) / 2;
    }

  private:
    const BoundaryModel& model_;
    double tolerance_;
    Box box_;
};

} // namespace

std::vector<std::uint8_t> find_outer_box(const Domain& domain, bool planar) {
    const auto triangles = static_cast<Index>(domain.model.triangle_count());
    const SideFinder finder(domain.model);
    const int counted = planar ? 4 : 6;
    const auto any_counted = [&](const Sides& sides) {
        return std::any_of(sides.begin(), sides.begin() + counted, [](bool on) { return on; });
    };
    std::vector<std::uint8_t> outer(triangles, 0);
    Sides reached = {};
    double covered = 0;
    bool has_body = false;
    for (Index t = 0; t < triangles; ++t) {
        const Sides in = finder.sides_of(t, true);
        if (any_counted(in)) {
            outer[t] = 1;
            covered += finder.area_of(t);
        } else if (!(planar && (in[4] || in[5]))) {
            has_body = true;
            const Sides touched = finder.sides_of(t, false);
            for (int s = 0; s < counted; ++s) reached[s] = reached[s] || touched[s];
        }
    }
    const Point e = finder.box().high - finder.box().low;
    const double whole = 2 * (planar ? (e.x + e.y) * e.z : e.x * e.y + e.y * e.z + e.z * e.x);
    if (!has_body || covered < kCovered * whole ||
        std::count(reached.begin(), reached.begin() + counted, true) > kMostReached)
        return {};
    return outer;
}

} // namespace hexopt
