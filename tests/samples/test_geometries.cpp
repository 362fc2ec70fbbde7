#include "samples/geometry/airfoil.hpp"
#include "samples/geometry/makers.hpp"
#include "samples/geometry/solid.hpp"
#include "support/skip.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <set>

using namespace hexopt;
using namespace hexopt::geometry;

namespace {

TriangleSoup make(std::string_view name, GeometryOptions options = {}) {
    Context context(1);
    auto made = make_geometry(name, options, context);
    INFO((made ? std::string() : made.error().one_line()));
    REQUIRE(made);
    return *made;
}

/// Every edge used once in each sense: closed, manifold along edges and consistently oriented.
void require_closed(const TriangleSoup& soup) {
    std::map<std::array<Index, 2>, int> balance;
    std::size_t unmatched = 0, repeated = 0;
    for (const auto& t : soup.triangles)
        for (int k = 0; k < 3; ++k)
            if (++balance[{t[k], t[(k + 1) % 3]}] > 1) ++repeated;
    for (const auto& [edge, count] : balance) unmatched += balance.count({edge[1], edge[0]}) == 0;
    CHECK(repeated == 0);
    CHECK(unmatched == 0);
    REQUIRE(soup.patch.size() == soup.triangles.size());
    std::set<std::array<double, 3>> places;
    for (const Point& p : soup.vertices) places.insert({p.x, p.y, p.z});
    CHECK(places.size() == soup.vertices.size());
}

std::set<std::string> names_of(const TriangleSoup& soup) {
    return {soup.patch_names.begin(), soup.patch_names.end()};
}

/// Area of a regular polygon within a circle.
double polygon_area(int sides, double radius) {
    return 0.5 * sides * radius * radius * std::sin(2 * std::numbers::pi / sides);
}

double area_of_patch(const TriangleSoup& soup, const std::string& name) {
    double area = 0;
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
        if (soup.patch_names[soup.patch[t]] != name) continue;
        const auto& [a, b, c] = soup.triangles[t];
        area += 0.5 * glm::length(glm::cross(soup.vertices[b] - soup.vertices[a],
                                             soup.vertices[c] - soup.vertices[a]));
    }
    return area;
}

} // namespace

TEST_CASE("geometries are closed, consistently oriented outward, and named") {
    const std::map<std::string, std::set<std::string>> expected = {
        {"cylinder", {"inlet", "wall", "outlet"}},
        {"three-pipe-joint", {"joint", "wall", "inlet", "outlet_1", "outlet_2"}},
        {"volute", {"casing", "chamber", "inlet", "inlet_pipe", "outlet"}},
        {"missile", {"inlet", "outlet", "farfield", "nose", "body", "base", "fins", "canards"}},
        {"ahmed",
         {"inlet", "outlet", "tunnel_side", "tunnel_top", "ground", "front", "roof", "slant", "base", "side",
          "underbody", "legs"}},
        {"wing", {"inlet", "outlet", "farfield", "symmetry", "wing", "wing_tip"}},
        {"business-jet",
         {"inlet", "outlet", "farfield", "symmetry", "fuselage", "wing", "wing_tip", "vertical_tail",
          "horizontal_tail", "pylon", "nacelle", "nacelle_inlet", "nacelle_outlet"}},
        {"wing-body",
         {"inlet", "outlet", "farfield", "symmetry", "fuselage", "wing", "wing_tip", "pylon", "nacelle",
          "nacelle_inlet", "nacelle_outlet", "nacelle_duct"}},
        {"front-wing",
         {"inlet", "outlet", "farfield", "symmetry", "ground", "nose", "main_plane", "flap", "endplate",
          "pylon"}},
        {"airfoil", {"airfoil", "inlet", "outlet", "farfield", "front", "back"}},
        {"multi-element", {"slat", "main", "flap", "inlet", "outlet", "farfield", "front", "back"}},
        {"cooled-blade",
         {"blade", "hub", "shroud", "passage_1", "passage_2", "passage_3", "passage_4", "passage_5",
          "passage_6", "passage_7"}},
        {"tire-gap", {"inlet", "outlet", "side", "road", "top", "tread", "grooves", "shoulder", "sidewall"}}};
    REQUIRE(geometry_names().size() == expected.size());
    for (const std::string& name : geometry_names()) {
        INFO(name);
        const TriangleSoup soup = make(name);
        require_closed(soup);
        CHECK(signed_volume(soup) > 0);
        CHECK(names_of(soup) == expected.at(name));
        CHECK(soup.patch_names.size() == expected.at(name).size());
    }
}

TEST_CASE("volumes of geometries agree with closed forms") {
    SECTION("cylinder") {
        for (int size : {12, 48, 301})
            CHECK(signed_volume(make("cylinder", {size, ""})) ==
                  Approx(4 * polygon_area(size, 1)).epsilon(1e-12));
    }
    SECTION("airfoil slab: a box less the section's area") {
        const auto outline = make_naca("2412", 48);
        REQUIRE(outline);
        const double volume = signed_volume(make("airfoil", {96, "2412"}));
        const double width = 14, height = 12; // chord 1
        CHECK(volume == Approx(0.02 * (width * height - 0.5 * twice_area(*outline))).epsilon(1e-6));
    }
    SECTION("cooled blade: the section less its passages") {
        const double radii[] = {0.028, 0.036, 0.042, 0.041, 0.036, 0.028, 0.019};
        double area = 0.5 * twice_area(make_naca_four({0.14, 0.4, 0.2}, 48));
        for (double r : radii) area -= polygon_area(48, r);
        CHECK(signed_volume(make("cooled-blade")) == Approx(0.1 * area).epsilon(1e-12));
    }
    SECTION("Ahmed body: width times height along its length, both linear between the nodes of the arcs") {
        const int size = 64, steps = size / 4;
        const double r = 0.1, length = 1.044, width = 0.389, height = 0.288;
        std::vector<std::array<double, 2>> arc; // x, inset from the full half width
        for (int i = 0; i <= steps; ++i) {
            const double t = 0.5 * std::numbers::pi * i / steps;
            arc.push_back({r - r * std::cos(t), r - r * std::sin(t)});
        }
        double body = 0;
        for (int i = 0; i < steps; ++i) {
            const auto product = [&](double inset) { return (width - 2 * inset) * (height - 2 * inset); };
            const double a = arc[i][1], b = arc[i + 1][1];
            body += (arc[i + 1][0] - arc[i][0]) * (product(a) + 4 * product(0.5 * (a + b)) + product(b)) / 6;
        }
        const double slant = 25 * std::numbers::pi / 180;
        body += (length - r) * width * height;
        body -= 0.5 * 0.222 * 0.222 * std::sin(slant) * std::cos(slant) * width;
        const double legs = 4 * 0.05 * polygon_area(16, 0.015);
        const double box = 8.5 * 1.87 * 1.4;
        CHECK(signed_volume(make("ahmed")) == Approx(box - body - legs).epsilon(1e-12));
    }
    SECTION("wing in its box: prismatoid of similar sections, less what lies beyond the symmetry plane") {
        const auto outline = make_naca("0010", 32);
        const WingShape shape{*outline, {0, 0, 0}, {1, 3, 0}, 2, 1, 0, 0, {0, 0, 1}, 5, "wing", "tip"};
        const auto wing = make_wing_solid(shape);
        REQUIRE(wing);
        const double area = 0.5 * twice_area(*outline);
        CHECK(signed_volume(*wing) == Approx(area * 3 * (4 + 2 + 1) / 3).epsilon(2e-3));
        CHECK(area_of_patch(*wing, "tip") == Approx(area * 5).epsilon(1e-9));
    }
}

TEST_CASE("Boolean operations on boxes keep names and give exact volumes") {
    const auto box = [](Point low, Point high, const std::string& n) {
        return make_box(low, high, {n, n, n, n, n, n});
    };
    const Solid a = box({0, 0, 0}, {2, 2, 2}, "a"), b = box({1, 1, 1}, {3, 3, 3}, "b");
    for (const auto& [volume, result] : {std::pair(15.0, BooleanSolid(a).unite(b).finish()),
                                         std::pair(7.0, BooleanSolid(a).subtract(b).finish()),
                                         std::pair(1.0, BooleanSolid(a).intersect(b).finish())}) {
        REQUIRE(result);
        require_closed(*result);
        CHECK(signed_volume(*result) == Approx(volume));
        CHECK(names_of(*result) == std::set<std::string>{"a", "b"});
    }
    const auto hollow = BooleanSolid(a).subtract(box({0.5, 0.5, 0.5}, {1, 1, 1}, "inner")).finish();
    REQUIRE(hollow);
    CHECK(signed_volume(*hollow) == Approx(8 - 0.125));
    CHECK(area_of_patch(*hollow, "inner") == Approx(1.5));
    const auto touching = BooleanSolid(a).unite(box({2, 2, 0}, {3, 3, 2}, "edge")).finish();
    CHECK_FALSE(touching); // along an edge: no manifold
}

TEST_CASE("NACA sections have the thickness and camber that their codes say") {
    const auto symmetric = make_naca("0012", 200);
    REQUIRE(symmetric);
    double highest = 0;
    for (const Point2& p : *symmetric) highest = std::max(highest, p.y);
    CHECK(2 * highest == Approx(0.12).epsilon(2e-3));
    // Abbott & von Doenhoff list y/c = 2.38 % for the NACA 2412's upper side at x/c = 25 %: 7.67 % at 25 %.
    const auto cambered = make_naca("2412", 400);
    double at_quarter = 0;
    for (const Point2& p : *cambered)
        if (p.y > 0 && std::abs(p.x - 0.25) < 0.005) at_quarter = p.y;
    CHECK(at_quarter == Approx(0.0767).epsilon(5e-3));
    // NACA 23012: largest camber 1.84 % at 15 %.
    const auto five = make_naca("23012", 400);
    REQUIRE(five);
    double camber = 0;
    for (std::size_t i = 1; i < 400; ++i)
        camber = std::max(camber, 0.5 * ((*five)[i].y + (*five)[800 - i].y));
    CHECK(camber == Approx(0.0184).epsilon(0.03));
    CHECK(make_naca("23112", 100));
    for (const char* wrong : {"", "12", "2400", "0412", "99912", "123456", "24x2"}) {
        INFO(wrong);
        CHECK_FALSE(make_naca(wrong, 100));
    }
}

TEST_CASE("airfoils come from coordinate files") {
    const std::filesystem::path file = HEXOPT_SHARED_DATA "/geometry/dat2d/rae2822.dat";
    if (!std::filesystem::exists(file)) HEXOPT_SKIP("no " + file.string());
    for (const char* name : {"airfoil", "wing"}) {
        const TriangleSoup soup = make(name, {0, file.string()});
        require_closed(soup);
    }
}

TEST_CASE("options of geometries are checked") {
    Context context(1);
    CHECK(make_geometry("teapot", {}, context).error().code == ErrorCode::usage);
    CHECK(make_geometry("cylinder", {5, ""}, context).error().code == ErrorCode::usage);
    CHECK(make_geometry("cylinder", {0, "0012"}, context).error().code == ErrorCode::usage);
    CHECK(make_geometry("airfoil", {0, "no-such-file.dat"}, context).error().code == ErrorCode::bad_input);
}
