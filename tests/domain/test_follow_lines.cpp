#include "domain/boundary_model.hpp"
#include "domain/sample_meshes.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <numbers>

using namespace hexopt;

namespace {

FeatureLines lines_of(const std::vector<Point>& points) {
    FeatureLines lines;
    lines.file = "lines.csv";
    for (std::size_t i = 0; i + 1 < points.size(); ++i) lines.segments.push_back({points[i], points[i + 1]});
    return lines;
}

constexpr BoundaryOptions kLinesOnly = {.feature_angle_deg = 180, .patch_borders = false};

Result<BoundaryModel> build(const HexMesh& mesh, const std::vector<FeatureLines>& lines,
                            const TriangleSoup* surface = nullptr,
                            const BoundaryOptions& options = kLinesOnly, double reach_rel = 1e-3) {
    Context context(1);
    const Topology topology = compute_topology(mesh);
    return surface ? build_boundary_model(mesh, topology, *surface, options, context, {lines, reach_rel})
                   : build_boundary_model(mesh, topology, options, context, {lines, reach_rel});
}

BoundaryModel require(Result<BoundaryModel> model) {
    if (!model) FAIL(model.error().one_line());
    return std::move(*model);
}

std::string refusal(const HexMesh& mesh, const std::vector<FeatureLines>& lines) {
    const Result<BoundaryModel> model = build(mesh, lines);
    if (model) return "accepted";
    CHECK(model.error().code == ErrorCode::bad_input);
    return model.error().one_line();
}

double length_of(const BoundaryModel& model) {
    double length = 0;
    for (Index s = 0; s < model.segment_count(); ++s)
        length += glm::distance(model.segment(s)[0], model.segment(s)[1]);
    return length;
}

/// Points of the circle round the cylinder at half its height; the last one is the first.
std::vector<Point> circle(int count) {
    std::vector<Point> points;
    for (int i = 0; i <= count; ++i) {
        const double angle = 2 * std::numbers::pi * (i % count) / count;
        points.emplace_back(std::cos(angle), std::sin(angle), 1);
    }
    return points;
}

} // namespace

TEST_CASE("a line along edges of a mesh's boundary is a curve of its own, however it is cut up") {
    const HexMesh mesh = test::cube(4);
    CHECK(require(build(mesh, {})).curve_count() == 0);
    for (const std::vector<Point>& points :
         {std::vector{Point(0.5, 0, 1), Point(0.5, 1, 1)},
          std::vector{Point(0.5, 0, 1), Point(0.5, 0.1, 1), Point(0.5, 0.7, 1), Point(0.5, 1, 1)},
          std::vector{Point(0.5001, 0, 1), Point(0.5, 0.5, 1.0001), Point(0.5, 1, 1)}}) {
        const BoundaryModel model = require(build(mesh, {lines_of(points)}));
        CHECK(model.curve_count() == 1);
        CHECK(model.corner_count() == 2);
        CHECK(model.patch_count() == 1);
        CHECK(model.feature_edges().size() == 4);
        for (const auto& edge : model.feature_edges())
            for (Index v : edge) {
                CHECK(mesh.positions[v].x == 0.5);
                CHECK(mesh.positions[v].z == 1);
            }
    }
}

TEST_CASE("lines divide patches, and stand beside features by angle") {
    const HexMesh mesh = test::cube(4);
    const FeatureLines ring =
        lines_of({Point(0, 0, 0.5), Point(1, 0, 0.5), Point(1, 1, 0.5), Point(0, 1, 0.5), Point(0, 0, 0.5)});
    const BoundaryModel alone = require(build(mesh, {ring}));
    CHECK(alone.patch_count() == 2);
    CHECK(alone.corner_count() == 4); // sharp turns
    CHECK(length_of(alone) == Approx(4));
    const BoundaryModel both = require(build(mesh, {ring}, nullptr, {}));
    CHECK(both.patch_count() == 10);
    CHECK(both.corner_count() == 12);
    CHECK(length_of(both) == Approx(16));
}

TEST_CASE("a finely cut round line follows the vertices that lie on it") {
    const HexMesh mesh = test::cylinder(4);
    const BoundaryModel model = require(build(mesh, {lines_of(circle(1000))}));
    CHECK(model.patch_count() == 2);
    CHECK(model.curve_count() == 1);
    CHECK(model.corner_count() == 0);
    CHECK(model.curve_closed(0));
    CHECK(model.feature_edges().size() == 16);
}

TEST_CASE("where levels meet, lines follow the edges of the finer side") {
    Context context(1);
    const Result<HexMesh> mesh = make_sample("octree-corner", {}, context);
    REQUIRE(mesh);
    Point low(1e300), high(-1e300);
    for (const Point& x : mesh->positions) low = glm::min(low, x), high = glm::max(high, x);
    const Point middle = 0.5 * (low + high);
    const BoundaryModel model =
        require(build(*mesh, {lines_of({Point(low.x, middle.y, low.z), Point(high.x, middle.y, low.z)})}));
    CHECK(model.curve_count() == 1);
    CHECK(length_of(model) == Approx(high.x - low.x));
    bool hangs = false;
    for (const auto& edge : model.feature_edges())
        for (Index v : edge) hangs = hangs || model.associations()[v].kind == EntityKind::hanging;
    CHECK(hangs);
}

TEST_CASE("lines that no edges of the mesh follow are refused with their place") {
    const HexMesh mesh = test::cube(4);
    using Catch::Contains;
    SECTION("off the boundary") {
        const std::string said = refusal(mesh, {lines_of({Point(0.5, 0, 0.9), Point(0.5, 1, 0.9)})});
        CHECK_THAT(said, Contains("lines.csv near (0.5, 0, 0.9)") && Contains("no vertex") &&
                             Contains("--features-reach"));
    }
    SECTION("across quads, from vertex to vertex") {
        const std::string said = refusal(mesh, {lines_of({Point(0, 0, 1), Point(1, 1, 1)})});
        CHECK_THAT(said, Contains("lines.csv near (0, 0, 1)") && Contains("no edges of the mesh's boundary"));
    }
    SECTION("ends within an edge") {
        CHECK_THAT(refusal(mesh, {lines_of({Point(0, 0.5, 1), Point(0.6, 0.5, 1)})}),
                   Contains("lines.csv near (0.6, 0.5, 1)") && Contains("no vertex"));
    }
    SECTION("leaves the edges half-way") {
        const std::string said =
            refusal(mesh, {lines_of({Point(0, 0.5, 1), Point(0.5, 0.5, 1), Point(0.75, 0.75, 1)})});
        CHECK_THAT(said, Contains("lines.csv near (0.5, 0.5, 1)"));
    }
    SECTION("a closed line elsewhere") {
        std::vector<Point> far = circle(20);
        CHECK_THAT(refusal(mesh, {lines_of(far)}), Contains("no edges"));
    }
    SECTION("places that are no numbers") {
        CHECK_THAT(refusal(mesh, {lines_of({Point(0, 0, std::nan("")), Point(1, 0, 1)})}),
                   Contains("no vertex"));
    }
    const std::vector<FeatureLines> fine = {lines_of({Point(0.5, 0, 1), Point(0.5, 1, 1)})};
    CHECK(build(mesh, fine, nullptr, kLinesOnly, 0.01));
    CHECK_FALSE(build(mesh, fine, nullptr, kLinesOnly, 0.02));
}

TEST_CASE("an edge cuts no hairpin bend short") {
    const HexMesh mesh = test::cube(8);
    // Out along one row of edges, over and back along the next one.
    const FeatureLines hairpin =
        lines_of({Point(0, 0.5, 1), Point(0.75, 0.5, 1), Point(0.75, 0.625, 1), Point(0, 0.625, 1)});
    const BoundaryModel model = require(build(mesh, {hairpin}));
    CHECK(length_of(model) == Approx(1.625));
}

TEST_CASE("lines on a given surface bind the vertices of the mesh's edges beside them") {
    const TriangleSoup surface = boundary_soup(test::cube(3), compute_topology(test::cube(3)));
    HexMesh mesh = test::cube(4);
    for (Point& x : mesh.positions) x.y += 0.02 * std::sin(7 * x.x) * x.z; // top edges of y = 0.5 wobble
    const FeatureLines line = lines_of({Point(0, 0.5, 1), Point(1, 0.5, 1)});
    const BoundaryModel model = require(build(mesh, {line}, &surface));
    CHECK(model.curve_count() == 1);
    CHECK(model.patch_count() == 1);
    CHECK(model.feature_edges().size() == 4);
    std::size_t bound = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const EntityKind kind = model.associations()[v].kind;
        bound += kind == EntityKind::curve || kind == EntityKind::corner;
    }
    CHECK(bound == 5);
    CHECK(model.association_report().unmatched_lines.empty());
    SECTION("what the mesh has no edges for is reported") {
        const BoundaryModel diagonal =
            require(build(mesh, {lines_of({Point(0, 0, 1), Point(1, 1, 1)})}, &surface));
        REQUIRE(diagonal.association_report().unmatched_lines.size() == 1);
        CHECK_THAT(diagonal.association_report().unmatched_lines.front(),
                   Catch::StartsWith("lines.csv near ("));
    }
    SECTION("what leaves the surface is refused") {
        const auto refused = build(mesh, {lines_of({Point(0, 0.5, 1.1), Point(1, 0.5, 1.1)})}, &surface);
        REQUIRE_FALSE(refused);
        CHECK_THAT(refused.error().one_line(), Catch::Contains("away from the surface"));
    }
}
