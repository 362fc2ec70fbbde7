#include "samples/geometry/airfoil.hpp"
#include "samples/geometry/makers.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace hexopt::geometry {

namespace {

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

std::vector<Point> place_section(const WingShape& shape, double t) {
    const Point nose = glm::mix(shape.root, shape.tip, t);
    const double chord = glm::mix(shape.root_chord, shape.tip_chord, t);
    const double twist = radians(glm::mix(shape.root_twist_deg, shape.twist_deg, t));
    const Point chordwise(1, 0, 0), up = glm::normalize(shape.up);
    const Point along = chordwise * std::cos(twist) - up * std::sin(twist);
    const Point across = chordwise * std::sin(twist) + up * std::cos(twist);
    std::vector<Point> section;
    for (const Point2& p : shape.outline) section.push_back(nose + chord * (p.x * along + p.y * across));
    return section;
}

/// Points along each side of an airfoil with which the nose has no crease that meshes would have to follow.
int outline_points(const GeometryOptions& options) { return 3 * options.size / 4; }

/// The outer box of half a body that is cut by the plane y = 0.
Solid make_half_box(const Point& low, const Point& high) {
    return make_box(low, high, {"inlet", "outlet", "symmetry", "farfield", "farfield", "farfield"});
}

Solid make_fuselage(int segments) {
    constexpr double kRadius = 1.1, kNose = 3.5, kTail = 12, kLength = 18;
    Profile profile{{{0, 0}}, {"fuselage"}};
    constexpr int kSteps = 16;
    for (int i = 1; i <= kSteps; ++i) {
        const double t = 0.5 * std::numbers::pi * i / kSteps;
        profile.points.emplace_back(kNose * (1 - std::cos(t)), kRadius * std::sin(t));
    }
    for (int i = 0; i < kSteps; ++i) {
        const double t = static_cast<double>(i) / kSteps;
        profile.points.emplace_back(glm::mix(kTail, kLength, t), kRadius * (1 - t * t));
    }
    profile.points.emplace_back(kLength, 0);
    // Turned by half a segment: vertices in the plane that cuts it, but for rounding, would leave slivers
    // there.
    const double turn = std::numbers::pi / segments;
    return transformed(revolve(profile, segments), glm::rotate(glm::dmat4(1), turn, glm::dvec3(1, 0, 0)));
}

Solid make_nacelle(int segments, const Point& nose) {
    const Profile profile{
        {{0, 0}, {0, 0.4}, {0.12, 0.5}, {0.5, 0.58}, {1.4, 0.6}, {2.2, 0.52}, {2.8, 0.38}, {2.8, 0}},
        {"nacelle_inlet", "nacelle", "nacelle", "nacelle", "nacelle", "nacelle", "nacelle_outlet"}};
    return transformed(revolve(profile, segments), glm::translate(glm::dmat4(1), nose));
}

} // namespace

Result<Solid> make_wing_solid(const WingShape& shape) {
    Loft wing{{}, {shape.name}, shape.tip_name, shape.tip_name};
    for (int i = 0; i <= shape.steps; ++i)
        wing.sections.push_back(place_section(shape, static_cast<double>(i) / shape.steps));
    return loft(wing);
}

Result<Solid> make_multi_element_slab(const GeometryOptions& options, Context&) {
    struct Element {
        const char* name;
        NacaSection section;
        double chord, down_deg; ///< turned nose up by a negative angle
        Point2 nose;
    };
    const std::array<Element, 3> kElements = {{{"slat", {0.06, 0.4, 0.12}, 0.17, -25, {-0.13, -0.1}},
                                               {"main", {0.04, 0.4, 0.12}, 1, 0, {0, 0}},
                                               {"flap", {0.05, 0.4, 0.12}, 0.3, 28, {0.985, -0.035}}}};
    Extrusion slab;
    slab.outer = {{{-5, -6}, {9, -6}, {9, 6}, {-5, 6}}, {"farfield", "outlet", "farfield", "inlet"}};
    for (const Element& element : kElements) {
        const double a = radians(-element.down_deg);
        Loop loop{{}, {element.name}};
        for (const Point2& p : make_naca_four(element.section, options.size / 2))
            loop.points.push_back(element.nose +
                                  element.chord * Point2(std::cos(a) * p.x - std::sin(a) * p.y,
                                                         std::sin(a) * p.x + std::cos(a) * p.y));
        slab.holes.push_back(std::move(loop));
    }
    slab.high = 0.01;
    slab.low_name = "back";
    slab.high_name = "front";
    return extrude(slab);
}

Result<Solid> make_airfoil_slab(const GeometryOptions& options, Context& context) {
    auto outline = make_airfoil(options.airfoil, options.size / 2, context);
    if (!outline) return outline.error();
    double left = outline->front().x, right = left;
    for (const Point2& p : *outline) left = std::min(left, p.x), right = std::max(right, p.x);
    const double chord = right - left;
    if (chord <= 0) return make_error(ErrorCode::bad_input, "sample", options.airfoil, "the chord is zero");
    Extrusion slab;
    slab.outer = {{{left - 5 * chord, -6 * chord},
                   {left + 9 * chord, -6 * chord},
                   {left + 9 * chord, 6 * chord},
                   {left - 5 * chord, 6 * chord}},
                  {"farfield", "outlet", "farfield", "inlet"}};
    slab.holes = {{std::move(*outline), {"airfoil"}}};
    slab.high = 0.02 * chord;
    slab.low_name = "back";
    slab.high_name = "front";
    return extrude(slab);
}

Result<Solid> make_cooled_blade(const GeometryOptions& options, Context&) {
    const NacaSection section{0.14, 0.4, 0.2};
    Extrusion blade;
    blade.outer = {make_naca_four(section, options.size), {"blade"}};
    blade.high = 0.1;
    blade.low_name = "hub";
    blade.high_name = "shroud";
    // Passages along the middle line, each with about a third of the thickness left on both sides.
    constexpr std::array<double, 7> kPlaces = {0.06, 0.16, 0.28, 0.41, 0.54, 0.66, 0.77};
    constexpr std::array<double, 7> kRadii = {0.028, 0.036, 0.042, 0.041, 0.036, 0.028, 0.019};
    const double m = section.camber, p = section.camber_place;
    for (std::size_t h = 0; h < kPlaces.size(); ++h) {
        const double x = kPlaces[h], scale = m / (x < p ? p * p : (1 - p) * (1 - p));
        const double middle = scale * ((x < p ? 0 : 1 - 2 * p) + 2 * p * x - x * x);
        Loop hole{{}, {"passage_" + std::to_string(h + 1)}};
        for (int i = 0; i < options.size; ++i) {
            const double t = 2 * std::numbers::pi * i / options.size;
            hole.points.emplace_back(x + kRadii[h] * std::cos(t), middle + kRadii[h] * std::sin(t));
        }
        blade.holes.push_back(std::move(hole));
    }
    return extrude(blade);
}

Result<Solid> make_wing(const GeometryOptions& options, Context& context) {
    auto outline = make_airfoil(options.airfoil, options.size / 2, context);
    if (!outline) return outline.error();
    const WingShape shape{
        std::move(*outline), {-0.2, -0.3, 0}, {1.9, 4, 0.28}, 1.5, 0.6, 0, -3, {0, 0, 1}, 8, "wing",
        "wing_tip"};
    const Result<Solid> wing = make_wing_solid(shape);
    if (!wing) return wing;
    return BooleanSolid(make_half_box({-10, 0, -10}, {16, 12, 10})).subtract(*wing).finish();
}

Result<Solid> make_wing_body(const GeometryOptions& options, Context&) {
    const auto outline = [&](const char* code) { return make_naca(code, outline_points(options)).value(); };
    const WingShape wing{outline("2412"), {6, -0.3, -0.6}, {10.6, 8.9, 0.17}, 3.6, 1, 2, -2, {0, 0, 1}, 8,
                         "wing",          "wing_tip"};
    const WingShape pylon{outline("0009"), {7.1, 3.2, -1.2}, {8.1, 3.2, -0.3}, 1.5, 1.3, 0, 0, {0, 1, 0}, 2,
                          "pylon",         "pylon"};
    const Result<Solid> wing_solid = make_wing_solid(wing), pylon_solid = make_wing_solid(pylon);
    if (!wing_solid) return wing_solid;
    if (!pylon_solid) return pylon_solid;
    BooleanSolid body(make_fuselage(options.size));
    body.unite(*wing_solid).unite(*pylon_solid);
    const Result<Solid> whole = body.unite(make_nacelle(options.size, {6.1, 3.2, -1.3})).finish();
    if (!whole) return whole;
    // What flows through the nacelle.
    const Profile duct{{{-0.1, 0}, {-0.1, 0.33}, {2.9, 0.33}, {2.9, 0}}, {"nacelle_duct"}};
    const Solid bore =
        transformed(revolve(duct, options.size), glm::translate(glm::dmat4(1), glm::dvec3(6.1, 3.2, -1.3)));
    return BooleanSolid(make_half_box({-30, 0, -30}, {60, 40, 30})).subtract(*whole).unite(bore).finish();
}

Result<Solid> make_business_jet(const GeometryOptions& options, Context&) {
    const auto outline = [&](const char* code) { return make_naca(code, outline_points(options)).value(); };
    const Point nacelle(11, 1.95, 0.75);
    const Point up(0, 0, 1), sideways(0, 1, 0);
    const std::string vertical = "vertical_tail", horizontal = "horizontal_tail", pylon = "pylon";
    const WingShape shapes[4] = {
        {outline("2412"), {6, -0.3, -0.55}, {10.6, 8.5, -0.05}, 4, 1.3, 2, -1, up, 8, "wing", "wing_tip"},
        {outline("0010"), {13, 0, 0.3}, {16.2, 0, 3.9}, 3.8, 2.2, 0, 0, sideways, 4, vertical, vertical},
        {outline("0009"), {15.9, -0.3, 3.2}, {17.7, 3.2, 3.2}, 1.9, 0.9, 0, 0, up, 4, horizontal, horizontal},
        {outline("0012"), {11.6, 0.3, 0.75}, {11.6, 1.95, 0.75}, 1.2, 1.2, 0, 0, up, 2, pylon, pylon}};
    BooleanSolid jet(make_fuselage(options.size));
    for (const WingShape& shape : shapes) {
        const Result<Solid> part = make_wing_solid(shape);
        if (!part) return part;
        jet.unite(*part);
    }
    const Result<Solid> body = jet.unite(make_nacelle(options.size, nacelle)).finish();
    if (!body) return body;
    return BooleanSolid(make_half_box({-30, 0, -30}, {60, 40, 30})).subtract(*body).finish();
}

} // namespace hexopt::geometry
