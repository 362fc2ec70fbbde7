#include "samples/geometry/airfoil.hpp"
#include "samples/geometry/makers.hpp"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace hexopt::geometry {

namespace {

constexpr double kRight = std::numbers::pi / 2;

/// Points of a quarter circle without its ends.
std::vector<Point2> quarter_arc(const Point2& centre, double radius, double from, int steps) {
    std::vector<Point2> points;
    for (int i = 1; i < steps; ++i) {
        const double t = from + kRight * i / steps;
        points.push_back(centre + radius * Point2(std::cos(t), std::sin(t)));
    }
    return points;
}

void append(Loop& loop, const std::vector<Point2>& points, const std::string& name) {
    loop.points.insert(loop.points.end(), points.begin(), points.end());
    loop.names.insert(loop.names.end(), points.size(), name);
}

/// (x, y) of a plane figure become x and z, its height y.
glm::dmat4 upright() { return {{1, 0, 0, 0}, {0, 0, 1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}; }

constexpr double kAhmedLength = 1.044, kAhmedWidth = 0.389, kAhmedHeight = 0.288, kAhmedRadius = 0.1;
constexpr double kAhmedClearance = 0.05, kSlantLength = 0.222;

/// The body between clearance and roof, as the common part of its side view and its top view.
Result<Solid> make_ahmed_body(int steps) {
    const double low = kAhmedClearance, high = low + kAhmedHeight, r = kAhmedRadius;
    const double slant = 25 * std::numbers::pi / 180;
    Extrusion side;
    Loop& outline = side.outer;
    append(outline, {{r, low}}, "underbody");
    append(outline, {{kAhmedLength, low}}, "base");
    append(outline, {{kAhmedLength, high - kSlantLength * std::sin(slant)}}, "slant");
    append(outline, {{kAhmedLength - kSlantLength * std::cos(slant), high}}, "roof");
    append(outline, {{r, high}}, "front");
    append(outline, quarter_arc({r, high - r}, r, kRight, steps), "front");
    append(outline, {{0, high - r}}, "front");
    append(outline, {{0, low + r}}, "front");
    append(outline, quarter_arc({r, low + r}, r, 2 * kRight, steps), "front");
    side.low = -kAhmedWidth;
    side.high = kAhmedWidth;
    side.low_name = side.high_name = "side";

    const double half = kAhmedWidth / 2;
    Extrusion top;
    append(top.outer, {{r, -half}}, "side");
    append(top.outer, {{2 * kAhmedLength, -half}}, "base");
    append(top.outer, {{2 * kAhmedLength, half}}, "side");
    append(top.outer, {{r, half}}, "front");
    append(top.outer, quarter_arc({r, half - r}, r, kRight, steps), "front");
    append(top.outer, {{0, half - r}}, "front");
    append(top.outer, {{0, -half + r}}, "front");
    append(top.outer, quarter_arc({r, -half + r}, r, 2 * kRight, steps), "front");
    top.low = -1;
    top.high = 1;
    const Result<Solid> side_solid = extrude(side), top_solid = extrude(top);
    if (!side_solid) return side_solid;
    if (!top_solid) return top_solid;
    return BooleanSolid(transformed(*side_solid, upright())).intersect(*top_solid).finish();
}

/// Flat plates between straight edges with a sharp nose and tail.
std::vector<Point2> make_diamond(double thickness) {
    return {{1, 0}, {0.5, thickness / 2}, {0, 0}, {0.5, -thickness / 2}};
}

Result<Solid> make_nose_cone(int size) {
    // Centre height, half width and half height of ellipses along the car.
    constexpr double kSections[][4] = {{-0.30, 0.330, 0.040, 0.030}, {-0.20, 0.345, 0.075, 0.055},
                                       {0.00, 0.370, 0.110, 0.085},  {0.30, 0.410, 0.140, 0.120},
                                       {0.70, 0.460, 0.170, 0.160},  {1.20, 0.500, 0.200, 0.200}};
    Loft cone{{}, {"nose"}, "nose", "nose_end"};
    for (const auto& [x, z, width, height] : kSections) {
        std::vector<Point> section;
        for (int i = 0; i < size; ++i) {
            const double t = 2 * std::numbers::pi * i / size;
            section.emplace_back(x, width * std::cos(t), z + height * std::sin(t));
        }
        cone.sections.push_back(std::move(section));
    }
    return loft(cone);
}

} // namespace

Result<Solid> make_missile(const GeometryOptions& options, Context&) {
    constexpr double kRadius = 0.5, kNose = 2.5, kLength = 10;
    constexpr int kSteps = 16;
    // Tangent ogive.
    const double rho = (kRadius * kRadius + kNose * kNose) / (2 * kRadius);
    Profile profile{{{0, 0}}, {}};
    for (int i = 1; i <= kSteps; ++i) {
        const double x = kNose * i / kSteps, d = kNose - x;
        profile.points.emplace_back(x, i == kSteps ? kRadius : std::sqrt(rho * rho - d * d) + kRadius - rho);
        profile.names.push_back("nose");
    }
    profile.points.insert(profile.points.end(), {{kLength, kRadius}, {kLength, 0}});
    profile.names.insert(profile.names.end(), {"body", "base"});
    BooleanSolid missile(revolve(profile, options.size));
    const WingShape shapes[2] = {
        {make_diamond(0.06), {7.6, 0, 0.2}, {8.8, 0, 1.5}, 2, 0.9, 0, 0, {0, 1, 0}, 4, "fins", "fins"},
        {make_diamond(0.06),
         {3.4, 0, 0.2},
         {3.9, 0, 1.0},
         0.9,
         0.4,
         0,
         0,
         {0, 1, 0},
         4,
         "canards",
         "canards"}};
    for (const WingShape& shape : shapes) {
        const Result<Solid> fin = make_wing_solid(shape);
        if (!fin) return fin;
        for (int i = 0; i < 4; ++i)
            missile.unite(
                transformed(*fin, glm::rotate(glm::dmat4(1), kRight * (i + 0.5), glm::dvec3(1, 0, 0))));
    }
    const Result<Solid> body = missile.finish();
    if (!body) return body;
    const Solid box = make_box({-8, -8, -8}, {24, 8, 8},
                               {"inlet", "outlet", "farfield", "farfield", "farfield", "farfield"});
    return BooleanSolid(box).subtract(*body).finish();
}

Result<Solid> make_ahmed(const GeometryOptions& options, Context&) {
    const Result<Solid> body = make_ahmed_body(options.size / 4);
    if (!body) return body;
    const Solid box = make_box({-2.5, -0.935, 0}, {6, 0.935, 1.4},
                               {"inlet", "outlet", "tunnel_side", "tunnel_side", "ground", "tunnel_top"});
    BooleanSolid flow(box);
    flow.subtract(*body);
    constexpr double kLegRadius = 0.015;
    for (const auto& [x, y] : {std::pair(0.202, 0.1635), std::pair(0.672, 0.1635)})
        for (double side : {-1.0, 1.0}) {
            const Profile leg{{{-0.01, 0}, {-0.01, kLegRadius}, {0.1, kLegRadius}, {0.1, 0}}, {"legs"}};
            glm::dmat4 map = glm::translate(glm::dmat4(1), glm::dvec3(x, side * y, 0));
            map = glm::rotate(map, -kRight, glm::dvec3(0, 1, 0));
            flow.subtract(transformed(revolve(leg, std::max(12, options.size / 4)), map));
        }
    return flow.finish();
}

Result<Solid> make_front_wing(const GeometryOptions& options, Context&) {
    const auto turned_over = [&](const char* code) {
        std::vector<Point2> outline = make_naca(code, options.size).value();
        for (Point2& p : outline) p.y = -p.y;
        return outline;
    };
    const auto upright_outline = make_naca("0012", options.size).value();
    const WingShape shapes[3] = {{turned_over("6412"),
                                  {-0.25, -0.1, 0.13},
                                  {-0.2, 0.9, 0.16},
                                  0.32,
                                  0.28,
                                  -4,
                                  -6,
                                  {0, 0, 1},
                                  8,
                                  "main_plane",
                                  "main_plane"},
                                 {turned_over("6410"),
                                  {0.05, 0.2, 0.20},
                                  {0.06, 0.9, 0.225},
                                  0.19,
                                  0.17,
                                  -24,
                                  -22,
                                  {0, 0, 1},
                                  8,
                                  "flap",
                                  "flap"},
                                 {upright_outline,
                                  {-0.17, 0.06, 0.14},
                                  {-0.12, 0.05, 0.36},
                                  0.14,
                                  0.16,
                                  0,
                                  0,
                                  {0, 1, 0},
                                  2,
                                  "pylon",
                                  "pylon"}};
    const Result<Solid> nose = make_nose_cone(options.size);
    if (!nose) return nose;
    BooleanSolid car(*nose);
    for (const WingShape& shape : shapes) {
        const Result<Solid> part = make_wing_solid(shape);
        if (!part) return part;
        car.unite(*part);
    }
    const std::string plate = "endplate";
    car.unite(make_box({-0.32, 0.85, 0.05}, {0.32, 0.862, 0.36}, {plate, plate, plate, plate, plate, plate}));
    const Result<Solid> body = car.finish();
    if (!body) return body;
    const Solid box = make_box({-3, 0, 0}, {1.2, 2.5, 2},
                               {"inlet", "outlet", "symmetry", "farfield", "ground", "farfield"});
    return BooleanSolid(box).subtract(*body).finish();
}

Result<Solid> make_tire_gap(const GeometryOptions& options, Context&) {
    constexpr double kRadius = 0.32, kGap = 0.0015, kHalf = 0.105, kDepth = 0.008, kGroove = 0.009;
    constexpr double kShoulder = 0.012;
    Profile tire{
        {{-kHalf - kShoulder, 0}, {-kHalf - kShoulder, kRadius - 0.6 * kShoulder}, {-kHalf, kRadius}},
        {"sidewall", "shoulder"}};
    for (double place : {-0.066, -0.022, 0.022, 0.066}) {
        tire.names.insert(tire.names.end(), {"tread", "grooves", "grooves", "grooves"});
        for (const auto& [x, r] :
             {std::pair(-kGroove / 2, kRadius), std::pair(-kGroove / 2, kRadius - kDepth),
              std::pair(kGroove / 2, kRadius - kDepth), std::pair(kGroove / 2, kRadius)})
            tire.points.emplace_back(place + x, r);
    }
    tire.names.insert(tire.names.end(), {"tread", "shoulder", "sidewall"});
    tire.points.insert(
        tire.points.end(),
        {{kHalf, kRadius}, {kHalf + kShoulder, kRadius - 0.6 * kShoulder}, {kHalf + kShoulder, 0}});
    glm::dmat4 map = glm::translate(glm::dmat4(1), glm::dvec3(0, 0, kRadius + kGap));
    map = glm::rotate(map, kRight, glm::dvec3(0, 0, 1));
    const Solid box =
        make_box({-0.3, -0.2, 0}, {0.3, 0.2, 0.05}, {"inlet", "outlet", "side", "side", "road", "top"});
    return BooleanSolid(box).subtract(transformed(revolve(tire, options.size), map)).finish();
}

} // namespace hexopt::geometry
