#include "domain/boundary_model.hpp"
#include "domain/sample_meshes.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <random>

using namespace hexopt;

namespace {

BoundaryModel build(const HexMesh& mesh, const BoundaryOptions& options = {}) {
    Context context(1);
    Result<BoundaryModel> model = build_boundary_model(mesh, compute_topology(mesh), options, context);
    if (!model) FAIL(model.error().one_line());
    return std::move(*model);
}

std::map<EntityKind, std::size_t> count_kinds(const BoundaryModel& model) {
    std::map<EntityKind, std::size_t> count;
    for (const Association& a : model.associations()) ++count[a.kind];
    return count;
}

void check_own_projections(const HexMesh& mesh, const BoundaryModel& model, double tolerance) {
    double largest = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        largest = std::max(largest, model.project(model.associations()[v], mesh.positions[v]).distance);
    CHECK(largest <= tolerance);
}

} // namespace

TEST_CASE("a cube has 6 patches, 12 curves and 8 corners") {
    const int n = 4;
    const HexMesh mesh = test::cube(n);
    const BoundaryModel model = build(mesh);
    CHECK(model.patch_count() == 6);
    CHECK(model.curve_count() == 12);
    CHECK(model.corner_count() == 8);
    CHECK(model.triangle_count() == 6 * n * n * 4);
    CHECK(model.segment_count() == 12 * n);
    CHECK(model.diagonal() == Approx(std::sqrt(3.0)));
    auto kinds = count_kinds(model);
    CHECK(kinds[EntityKind::corner] == 8);
    CHECK(kinds[EntityKind::curve] == 12 * (n - 1));
    CHECK(kinds[EntityKind::patch] == 6 * (n - 1) * (n - 1));
    CHECK(kinds[EntityKind::interior] == (n - 1) * (n - 1) * (n - 1));
    check_own_projections(mesh, model, 0);
}

TEST_CASE("a cylinder has two closed curves without corners") {
    const HexMesh mesh = test::cylinder(12);
    const BoundaryModel model = build(mesh);
    CHECK(model.patch_count() == 3);
    REQUIRE(model.curve_count() == 2);
    CHECK(model.corner_count() == 0);
    for (Index c = 0; c < 2; ++c) {
        CHECK(model.curve_closed(c));
        const auto points = model.curve_points(c);
        CHECK(points.size() == 4 * 12 + 1);
        CHECK(points.front() == points.back());
    }
    check_own_projections(mesh, model, 0);
}

TEST_CASE("a ball has one patch and no features") {
    const HexMesh mesh = test::ball(10);
    const BoundaryModel model = build(mesh);
    CHECK(model.patch_count() == 1);
    CHECK(model.curve_count() == 0);
    CHECK(model.corner_count() == 0);
    const Association on_ball{EntityKind::patch, 0};
    double worst = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        if (model.associations()[v].kind != EntityKind::patch) continue;
        const Projection p = model.project(on_ball, mesh.positions[v] * 1.3);
        const LocalFrame frame = model.local_frame(on_ball, p);
        CHECK(frame.freedom == 2);
        worst = std::max(worst, std::acos(std::min(1.0, glm::dot(p.smooth_direction, mesh.positions[v]))));
        CHECK(std::abs(glm::dot(frame.axis[0], frame.axis[1])) < 1e-14);
        CHECK(glm::dot(glm::cross(frame.axis[0], frame.axis[1]), frame.axis[2]) == Approx(1));
    }
    CHECK(worst < 0.08);
    // Normals within radius r of a point of the unit sphere differ by up to about 2r.
    CHECK(model.normal_spread(on_ball, Point(0, 0, 1), 0.3) == Approx(0.6).margin(0.25));
    CHECK(model.normal_spread(on_ball, Point(0, 0, 1), 0.0) < 0.3);
}

TEST_CASE("the feature angle decides on a wedge's edges") {
    // The top's normal leans towards the low side: 90 degrees less the slope between their normals.
    const HexMesh mesh = test::wedge(4, 0.5);
    const double slope = std::atan(0.5) * 180 / std::numbers::pi;
    BoundaryOptions options;
    options.feature_angle_deg = 90 - slope - 1;
    CHECK(build(mesh, options).patch_count() == 6);
    options.feature_angle_deg = 90 - slope + 1;
    const BoundaryModel merged = build(mesh, options);
    CHECK(merged.patch_count() == 5);
    CHECK(merged.curve_count() == 11);
}

TEST_CASE("borders between named patches are features") {
    HexMesh mesh = test::cube(4);
    const Topology topology = compute_topology(mesh);
    mesh.patch_names = {"low", "high"};
    for (CellFace face : topology.boundary_faces) {
        const Quad quad = face_vertices(mesh, face);
        double z = 0;
        for (Index v : quad) z += mesh.positions[v].z / 4;
        mesh.boundary.push_back({quad, z > 0.5 ? 1u : 0u});
    }
    const BoundaryModel model = build(mesh);
    CHECK(model.patch_count() == 10);
    CHECK(model.corner_count() == 12);
    CHECK(model.curve_count() == 20);
    BoundaryOptions options;
    options.patch_borders = false;
    CHECK(build(mesh, options).patch_count() == 6);
}

TEST_CASE("a vertex or an edge where the boundary touches itself is a feature") {
    HexMesh mesh = test::cube(2);
    SECTION("edge") { mesh.cells = {mesh.cells[0], mesh.cells[3]}; }
    SECTION("vertex") { mesh.cells = {mesh.cells[0], mesh.cells[7]}; }
    const BoundaryModel model = build(mesh);
    CHECK(model.associations()[13].kind == EntityKind::corner); // the centre of the cube
    CHECK(model.patch_count() == 12);
}

TEST_CASE("a mesh without boundary or with a position that is not finite is refused") {
    Context context(1);
    HexMesh mesh;
    Result<BoundaryModel> empty = build_boundary_model(mesh, compute_topology(mesh), {}, context);
    REQUIRE_FALSE(empty);
    CHECK(empty.error().code == ErrorCode::bad_input);
    mesh = test::cube(2);
    mesh.positions[3].y = std::numeric_limits<double>::quiet_NaN();
    Result<BoundaryModel> bad = build_boundary_model(mesh, compute_topology(mesh), {}, context);
    REQUIRE_FALSE(bad);
    CHECK(bad.error().where == "vertex 3");
}

TEST_CASE("closest points agree with trying every triangle, whatever the hint") {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const HexMesh mesh = test::grid(5, 6, 7, [&](const Point& p) {
        return 3.0 * p + 0.08 * Point(uniform(random), uniform(random), uniform(random)) +
               Point(1000, 0, -500);
    });
    const BoundaryModel model = build(mesh);
    for (int i = 0; i < 400; ++i) {
        const double reach = i % 2 ? 0.2 : 4;
        const Point q = mesh.positions[random() % mesh.vertex_count()] +
                        reach * Point(uniform(random), uniform(random), uniform(random));
        const Index patch = i % 3 == 0 ? kNoIndex : static_cast<Index>(random() % model.patch_count());
        double nearest = 1e300;
        for (Index t = 0; t < model.triangle_count(); ++t) {
            if (patch != kNoIndex && model.patch_of_triangle(t) != patch) continue;
            // Another formula than the library's: foot on the plane, or else the nearest of the three edges.
            const auto& x = model.triangle(t);
            const Point n = glm::cross(x[1] - x[0], x[2] - x[0]);
            const double w1 = glm::dot(glm::cross(q - x[0], x[2] - x[0]), n) / glm::dot(n, n);
            const double w2 = glm::dot(glm::cross(x[1] - x[0], q - x[0]), n) / glm::dot(n, n);
            if (w1 >= 0 && w2 >= 0 && w1 + w2 <= 1)
                nearest =
                    std::min(nearest, glm::length(q - (x[0] + w1 * (x[1] - x[0]) + w2 * (x[2] - x[0]))));
            for (int k = 0; k < 3; ++k) {
                const Point d = x[(k + 1) % 3] - x[k];
                const double s = std::clamp(glm::dot(q - x[k], d) / glm::dot(d, d), 0.0, 1.0);
                nearest = std::min(nearest, glm::length(q - x[k] - s * d));
            }
        }
        const Projection cold = model.project_patch(patch, q);
        CHECK(cold.distance == Approx(nearest).epsilon(1e-9).margin(1e-12));
        CHECK(glm::length(q - cold.point) == Approx(cold.distance).margin(1e-12));
        const Projection warm =
            model.project_patch(patch, q, static_cast<Index>(random() % model.triangle_count()));
        CHECK(warm.point == cold.point);
        CHECK(warm.element == cold.element);
    }
}

TEST_CASE("closest points on curves agree with trying every segment") {
    const HexMesh mesh = test::cylinder(16);
    const BoundaryModel model = build(mesh);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-2, 2);
    for (int i = 0; i < 200; ++i) {
        const Point q(uniform(random), uniform(random), uniform(random));
        const auto points = model.curve_points(1);
        double nearest = 1e300;
        for (std::size_t k = 0; k + 1 < points.size(); ++k) {
            const Point d = points[k + 1] - points[k];
            const double s = std::clamp(glm::dot(q - points[k], d) / glm::dot(d, d), 0.0, 1.0);
            nearest = std::min(nearest, glm::length(q - points[k] - s * d));
        }
        const Projection p = model.project_curve(1, q, static_cast<Index>(i));
        CHECK(p.distance == Approx(nearest).epsilon(1e-12));
        CHECK(std::abs(p.direction.z) < 1e-14);
        CHECK(glm::length(p.smooth_direction) == Approx(1));
        CHECK(model.local_frame({EntityKind::curve, 1}, p).freedom == 1);
    }
}
