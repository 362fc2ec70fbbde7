#include "samples/geometry/makers.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace hexopt::geometry {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Turns the x axis into `direction`.
glm::dmat4 along(const Point& direction) {
    const Point x = glm::normalize(direction);
    const Point other = std::abs(x.z) < 0.9 ? Point(0, 0, 1) : Point(0, 1, 0);
    const Point y = glm::normalize(glm::cross(other, x)), z = glm::cross(x, y);
    return {glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(0, 0, 0, 1)};
}

Solid make_ball(double radius, int segments, const std::string& name) {
    Profile arc{{{-radius, 0}}, {name}};
    const int steps = segments / 2;
    for (int i = 1; i < steps; ++i) {
        const double angle = std::numbers::pi * i / steps;
        arc.points.emplace_back(-radius * std::cos(angle), radius * std::sin(angle));
    }
    arc.points.emplace_back(radius, 0);
    return revolve(arc, segments);
}

/// A circle in the plane of the axis (z) and the direction from it at `angle`.
std::vector<Point> spiral_section(double angle, double centre, double radius, const Point& shift, int size) {
    const Point outward(std::cos(angle), std::sin(angle), 0);
    std::vector<Point> section;
    for (int i = 0; i < size; ++i) {
        const double t = kTurn * i / size;
        section.push_back(shift + outward * (centre + radius * std::cos(t)) +
                          Point(0, 0, radius * std::sin(t)));
    }
    return section;
}

/// The scroll from one angle to another, and from there straight on over `outlet` model units.
Result<Solid> make_scroll(double from, double to, double outlet, int size) {
    constexpr double kImpeller = 1, kSmallest = 0.08, kGrowth = 0.3 / kTurn, kFlare = 0.08;
    const auto radius = [](double angle) { return kSmallest + kGrowth * angle; };
    const auto centre = [&](double angle) { return kImpeller + 0.8 * radius(angle); };
    const int steps = std::max(1, static_cast<int>(std::lround((to - from) / kTurn * size)));
    Loft tube{{}, {"casing"}, "casing", "casing"};
    for (int i = 0; i <= steps; ++i) {
        const double angle = from + (to - from) * i / steps;
        tube.sections.push_back(spiral_section(angle, centre(angle), radius(angle), Point(0), size));
    }
    constexpr int kOutletSteps = 12;
    const Point onward(-std::sin(to), std::cos(to), 0);
    for (int i = 1; outlet > 0 && i <= kOutletSteps; ++i) {
        const double way = outlet * i / kOutletSteps;
        tube.sections.push_back(
            spiral_section(to, centre(to), radius(to) + kFlare * way, onward * way, size));
        tube.last_name = "outlet";
    }
    return loft(tube);
}

} // namespace

Result<Solid> make_cylinder(const GeometryOptions& options, Context&) {
    return revolve({{{0, 0}, {0, 1}, {4, 1}, {4, 0}}, {"inlet", "wall", "outlet"}}, options.size);
}

Result<Solid> make_three_pipe_joint(const GeometryOptions& options, Context&) {
    struct Pipe {
        double radius, length;
        Point direction;
        const char* end;
    };
    const Pipe pipes[] = {{1, 4, {1, 0, 0}, "inlet"},
                          {0.9, 3.6, {-0.5, 0.85, 0.1}, "outlet_1"},
                          {0.8, 3.4, {-0.55, -0.8, 0.25}, "outlet_2"}};
    BooleanSolid joint(make_ball(1.2, options.size, "joint"));
    for (const Pipe& pipe : pipes) {
        const Profile straight{{{0, 0}, {0, pipe.radius}, {pipe.length, pipe.radius}, {pipe.length, 0}},
                               {"joint", "wall", pipe.end}};
        joint.unite(transformed(revolve(straight, options.size), along(pipe.direction)));
    }
    return joint.finish();
}

Result<Solid> make_volute(const GeometryOptions& options, Context&) {
    const double half = std::numbers::pi;
    const Result<Solid> first = make_scroll(0.1, half, 0, options.size);
    const Result<Solid> second = make_scroll(half, 2 * half, 1.8, options.size);
    if (!first) return first;
    if (!second) return second;
    const glm::dmat4 upright = along({0, 0, 1});
    const Solid chamber = transformed(
        revolve({{{-0.06, 0}, {-0.06, 1.02}, {0.06, 1.02}, {0.06, 0}}, {"chamber"}}, options.size), upright);
    const Solid inlet =
        transformed(revolve({{{0, 0}, {0, 0.55}, {1.2, 0.55}, {1.2, 0}}, {"chamber", "inlet_pipe", "inlet"}},
                            options.size),
                    upright);
    BooleanSolid volute(*second);
    return volute.unite(*first).unite(chamber).unite(inlet).finish();
}

} // namespace hexopt::geometry
