#include "domain/deviation.hpp"
#include "domain/sample_meshes.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

TriangleSoup soup_of(const HexMesh& mesh) { return boundary_soup(mesh, compute_topology(mesh)); }

BoundaryModel fit(const HexMesh& mesh, const TriangleSoup& surface, const BoundaryOptions& options = {}) {
    Context context(1);
    Result<BoundaryModel> model =
        build_boundary_model(mesh, compute_topology(mesh), surface, options, context);
    if (!model) FAIL(model.error().one_line());
    return std::move(*model);
}

Deviation measure(const HexMesh& mesh, const BoundaryModel& model) {
    Context context(1);
    Result<Deviation> d = measure_deviation(mesh, compute_topology(mesh), model, {}, context);
    if (!d) FAIL(d.error().one_line());
    return std::move(*d);
}

std::string refusal(const TriangleSoup& surface, const BoundaryOptions& options = {}) {
    Context context(1);
    const HexMesh mesh = test::cube(2);
    const Result<BoundaryModel> model =
        build_boundary_model(mesh, compute_topology(mesh), surface, options, context);
    return model ? "accepted" : model.error().one_line();
}

std::size_t count(const BoundaryModel& model, EntityKind kind) {
    std::size_t n = 0;
    for (const Association& a : model.associations()) n += a.kind == kind;
    return n;
}

} // namespace

TEST_CASE("a cube's vertices are bound to the corners, edges and faces of the same cube given as triangles") {
    const int n = 5;
    HexMesh mesh = test::cube(n);
    const TriangleSoup surface = soup_of(test::cube(3)); // other triangles, the same cube
    const BoundaryModel model = fit(mesh, surface);
    CHECK(model.patch_count() == 6);
    CHECK(count(model, EntityKind::corner) == 8);
    CHECK(count(model, EntityKind::curve) == 12 * (n - 1));
    CHECK(count(model, EntityKind::patch) == 6 * (n - 1) * (n - 1));
    CHECK(model.feature_edges().size() == 12 * n);
    const AssociationReport& report = model.association_report();
    CHECK(report.largest_distance < 1e-15);
    CHECK(report.far_count + report.unmatched_corners + report.unmatched_curves + report.unmatched_vertices ==
          0);
    CHECK(report.open_edges + report.nonmanifold_edges + report.dropped_triangles == 0);
    const Deviation d = measure(mesh, model);
    CHECK(d.largest() < 1e-15);
    CHECK(d.feature_largest() < 1e-15);

    SECTION("and to the same ones when the mesh lies a little beside it") {
        const std::vector<Association> exact(model.associations().begin(), model.associations().end());
        HexMesh shrunk = test::cube(n);
        for (Point& x : shrunk.positions) x = 0.5 + 0.96 * (x - 0.5);
        const BoundaryModel beside = fit(shrunk, surface);
        CHECK(std::equal(exact.begin(), exact.end(), beside.associations().begin()));
        CHECK(beside.association_report().largest_distance == Approx(0.02 * std::sqrt(3.0)));
    }
    SECTION("and those far away are named") {
        for (Point& x : mesh.positions) x.z += 0.3;
        const AssociationReport far = fit(mesh, surface).association_report();
        CHECK(far.far_count > 0);
        CHECK(far.unmatched_corners > 0);
        REQUIRE_FALSE(far.far_vertices.empty());
        CHECK(far.far_vertices[0].distance == Approx(0.3));
        CHECK(mesh.positions[far.far_vertices[0].vertex].z == Approx(1.3));
        CHECK(far.largest_distance == Approx(0.3));
    }
}

TEST_CASE("a coarse cylinder follows the two circles of a fine one") {
    const int n = 8;
    const HexMesh mesh = test::cylinder(n);
    const BoundaryModel model = fit(mesh, soup_of(test::cylinder(4 * n)));
    CHECK(model.curve_count() == 2);
    CHECK(model.feature_edges().size() == 2 * 4 * n);
    CHECK(count(model, EntityKind::curve) == 2 * 4 * n);
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const Association a = model.associations()[v];
        if (a.kind != EntityKind::curve) continue;
        CHECK(model.curve_points(a.entity)[0].z == Approx(mesh.positions[v].z).margin(1e-12));
    }
    CHECK(model.association_report().unmatched_curves == 0);
    // Points of the grid are not spread evenly over the circle: the widest chord spans atan(1/4).
    const double chord = std::atan(2.0 / n), sagitta = 1 - std::cos(chord / 2);
    const Deviation d = measure(mesh, model);
    CHECK(d.largest() == Approx(sagitta).epsilon(0.1));
    CHECK(d.curves_to_mesh.largest == Approx(sagitta).epsilon(0.1));
}

TEST_CASE("a border between coplanar named patches is a curve for the vertices that lie on it") {
    TriangleSoup surface = soup_of(test::cube(4));
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        double x = 0;
        for (Index v : surface.triangles[t]) x += surface.vertices[v].x / 3;
        surface.patch[t] = x < 0.5 ? 0 : 1;
    }
    const BoundaryModel model = fit(test::cube(4), surface);
    CHECK(model.patch_count() == 10);
    CHECK(model.corner_count() == 12);
    CHECK(count(model, EntityKind::corner) == 12);
    CHECK(count(model, EntityKind::curve) == (12 + 4) * 3 - 4);
    CHECK(model.association_report().unmatched_curves == 0);
    BoundaryOptions options;
    options.patch_borders = false;
    CHECK(fit(test::cube(4), surface, options).patch_count() == 6);
}

TEST_CASE("triangles turned over, repeated or without area change nothing") {
    const HexMesh mesh = test::cylinder(6);
    TriangleSoup surface = soup_of(test::cylinder(12));
    const BoundaryModel expected = fit(mesh, surface);
    std::mt19937 random(1);
    for (auto& t : surface.triangles)
        if (random() % 2) std::swap(t[0], t[1]);
    surface.triangles.push_back(surface.triangles[5]);
    surface.triangles.push_back({surface.triangles[5][0], surface.triangles[5][0], surface.triangles[5][1]});
    surface.patch.insert(surface.patch.end(), 2, surface.patch[5]);
    const BoundaryModel model = fit(mesh, surface);
    CHECK(model.patch_count() == expected.patch_count());
    CHECK(model.curve_count() == expected.curve_count());
    CHECK(model.association_report().dropped_triangles == 2);
    CHECK(std::equal(model.associations().begin(), model.associations().end(),
                     expected.associations().begin()));
    // Normals within a patch point to one side all the same.
    const Point at(1.1, 0.01, 1), beside(0.01, 1.1, 1);
    const Index side = model.patch_of_triangle(model.project_patch(kNoIndex, at).element);
    const Projection a = model.project_patch(side, at), b = model.project_patch(side, beside);
    CHECK(std::abs(glm::dot(a.smooth_direction, Point(1, 0, 0))) > 0.9);
    CHECK(a.smooth_direction.x * b.smooth_direction.y > 0);
}

TEST_CASE("an open surface has features along its rim, and says so") {
    TriangleSoup surface = soup_of(test::cube(3));
    std::vector<std::array<Index, 3>> kept;
    for (const auto& t : surface.triangles) {
        double z = 0;
        for (Index v : t) z += surface.vertices[v].z / 3;
        if (z < 0.999) kept.push_back(t);
    }
    surface.triangles = kept;
    surface.patch.clear();
    const BoundaryModel model = fit(test::cube(3), surface);
    CHECK(model.patch_count() == 5);
    CHECK(model.curve_count() == 12);
    CHECK(model.association_report().open_edges == 12);
}

TEST_CASE("a refined mesh with hanging vertices follows a given cube") {
    Context context(1);
    Result<HexMesh> mesh = make_sample("octree-corner", {}, context);
    REQUIRE(mesh);
    const BoundaryModel model = fit(*mesh, soup_of(test::cube(3)));
    CHECK(model.association_report().unmatched_curves == 0);
    const Deviation d = measure(*mesh, model);
    CHECK(d.largest() < 1e-15);
    CHECK(d.feature_largest() < 1e-15);
    CHECK(count(model, EntityKind::hanging) == mesh->hanging.count());
}

TEST_CASE("surfaces and options that cannot be used are refused") {
    TriangleSoup surface;
    CHECK(refusal(surface) == "surface: no triangle with an area among 0");
    surface.vertices = {Point(0), Point(1, 0, 0), Point(0, 1, 0), Point(2, 0, 0)};
    surface.triangles = {{0, 1, 3}};
    CHECK(refusal(surface) == "surface: no triangle with an area among 1");
    surface.triangles = {{0, 1, 4}};
    CHECK(refusal(surface) == "surface: triangle 0: vertex 4 of 4 does not exist");
    surface.triangles = {{0, 1, 2}};
    surface.patch = {0, 0};
    CHECK(refusal(surface) == "surface: 2 patch numbers for 1 triangles");
    surface.patch.clear();
    CHECK(refusal(surface) == "accepted");
    BoundaryOptions options;
    options.feature_angle_deg = 200;
    CHECK(refusal(surface, options) == "boundary: the feature angle must lie in 0..180 degrees");
    surface.vertices[2].z = std::numeric_limits<double>::infinity();
    CHECK(refusal(surface) == "surface: vertex 2: a coordinate is not finite");
}
