#include "domain/deviation.hpp"
#include "domain/sample_meshes.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

struct Measured {
    Topology topology;
    BoundaryModel model;
};

Measured build(const HexMesh& mesh) {
    Context context(1);
    Topology topology = compute_topology(mesh);
    Result<BoundaryModel> model = build_boundary_model(mesh, topology, {}, context);
    if (!model) FAIL(model.error().one_line());
    return {std::move(topology), std::move(*model)};
}

Deviation measure(const HexMesh& moved, const Measured& original, const DeviationOptions& options = {},
                  int threads = 1) {
    Context context(threads);
    Result<Deviation> deviation =
        measure_deviation(moved, original.topology, original.model, options, context);
    if (!deviation) FAIL(deviation.error().one_line());
    return std::move(*deviation);
}

HexMesh jittered(double amount, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-amount, amount);
    return test::grid(6, 5, 4, [&](const Point& p) {
        return 2.0 * p + Point(uniform(random), uniform(random), uniform(random));
    });
}

} // namespace

TEST_CASE("a mesh deviates from its own boundary by exactly nothing") {
    for (const HexMesh& mesh :
         {test::cube(3), test::ball(6), test::cylinder(6), jittered(0.1, 1), jittered(0.3, 2)}) {
        const Deviation d = measure(mesh, build(mesh));
        CHECK(d.mesh_to_surface.upper == 0);
        CHECK(d.surface_to_mesh.upper == 0);
        CHECK(d.feature_largest() == 0);
        CHECK(d.largest_rel() == 0);
        CHECK(d.within_tenth_h_pct == 100);
    }
}

TEST_CASE("a cube grown about its centre deviates by what geometry says") {
    const HexMesh cube = test::cube(4);
    const Measured original = build(cube);
    HexMesh grown = cube;
    for (Point& x : grown.positions) x = 1.2 * (x - 0.5) + 0.5;
    DeviationOptions options;
    options.tolerance = 1e-3;
    const Deviation d = measure(grown, original, options);
    CHECK(d.mesh_to_surface.largest == Approx(0.1 * std::sqrt(3.0)));
    CHECK(d.mesh_to_surface.upper == Approx(0.1 * std::sqrt(3.0)).epsilon(1e-3));
    CHECK(d.surface_to_mesh.largest == Approx(0.1).epsilon(1e-3));
    CHECK(d.mesh_to_curves.largest == Approx(0.1 * std::sqrt(3.0)).epsilon(1e-3));
    CHECK(d.curves_to_mesh.largest == Approx(0.1 * std::sqrt(2.0)).epsilon(1e-3));
    CHECK(d.largest_corner_distance == Approx(0.1 * std::sqrt(3.0)));
    CHECK(d.largest_rel() == Approx(0.1));
    CHECK(d.mesh_to_surface.rms > 0.1);
    CHECK(d.mesh_to_surface.rms < 0.1 * std::sqrt(3.0));
    CHECK(d.bilinear_gap < 1e-15);
}

TEST_CASE("the share of the area within a tenth of a cell is what geometry says") {
    const HexMesh cube = test::cube(4);
    const Measured original = build(cube);
    const auto share = [&](const Point& factor, int threads) {
        HexMesh grown = cube;
        for (Point& x : grown.positions) x = factor * x;
        return measure(grown, original, {}, threads).within_tenth_h_pct;
    };
    CHECK(share({1, 1, 1}, 1) == 100);
    CHECK(share({1.01, 1.01, 1.01}, 1) == 100);
    CHECK(share({1.5, 1.5, 1.5}, 1) < 51); // the three faces that stay in their planes
    // The top and the upper parts of the sides of the mesh and the top of the surface are off.
    const double quads = 1 + 4 * 1.02, all_quads = 2 + 4 * 1.2, all_surface = 6;
    CHECK(share({1, 1, 1.2}, 1) == Approx(100 * (quads + 5) / (all_quads + all_surface)).margin(1.5));
    CHECK(share({1, 1, 1.2}, 3) == share({1, 1, 1.2}, 1));
}

TEST_CASE("vertices that slide in flat faces and along straight edges cause no deviation") {
    const HexMesh cube = test::cube(6);
    HexMesh slid = cube;
    for (Point& x : slid.positions)
        for (int k = 0; k < 3; ++k) x[k] += 0.6 * x[k] * (1 - x[k]) * (0.5 - x[(k + 1) % 3] * x[(k + 2) % 3]);
    const Deviation d = measure(slid, build(cube));
    CHECK(std::max(d.mesh_to_surface.upper, d.surface_to_mesh.upper) < 1e-6);
    CHECK(std::max(d.mesh_to_curves.upper, d.curves_to_mesh.upper) < 1e-6);
    CHECK(d.largest() < 1e-15);
}

TEST_CASE("the bracket of the deviation holds every sample, the place attains it, threads change nothing") {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(0, 1);
    const HexMesh mesh = jittered(0.05, 3);
    const Measured original = build(mesh);
    HexMesh moved = mesh;
    for (Point& x : moved.positions) x += 0.1 * Point(uniform(random), uniform(random), uniform(random));
    const Deviation d = measure(moved, original);
    const Measured other = build(moved);
    auto check = [&](const DirectedDeviation& directed, const BoundaryModel& from, const BoundaryModel& to) {
        CHECK(directed.largest <= directed.upper);
        CHECK(directed.upper <= 1.0101 * directed.largest);
        CHECK(to.distance(directed.at) == Approx(directed.largest).epsilon(1e-12));
        double sampled = 0;
        for (Index t = 0; t < from.triangle_count(); ++t)
            for (int i = 0; i < 20; ++i) {
                double u = uniform(random), v = uniform(random);
                if (u + v > 1) u = 1 - u, v = 1 - v;
                const auto& x = from.triangle(t);
                sampled = std::max(sampled, to.distance(x[0] + u * (x[1] - x[0]) + v * (x[2] - x[0])));
            }
        CHECK(sampled <= directed.upper);
        CHECK(sampled > 0.8 * directed.largest);
    };
    check(d.mesh_to_surface, other.model, original.model);
    check(d.surface_to_mesh, original.model, other.model);
    const Deviation again = measure(moved, original, {}, 2);
    CHECK(again.mesh_to_surface.largest == d.mesh_to_surface.largest);
    CHECK(again.surface_to_mesh.upper == d.surface_to_mesh.upper);
    CHECK(again.surface_to_mesh.at == d.surface_to_mesh.at);
}

TEST_CASE("too small a number of queries leaves a wider bracket, not a wrong one") {
    const HexMesh mesh = test::ball(6);
    const Measured original = build(mesh);
    HexMesh moved = mesh;
    for (Point& x : moved.positions) x *= 1 + 0.1 * x.x;
    DeviationOptions options;
    options.max_queries = 1;
    const Deviation rough = measure(moved, original, options), fine = measure(moved, original);
    CHECK(rough.mesh_to_surface.largest <= fine.mesh_to_surface.upper);
    CHECK(rough.mesh_to_surface.upper >= fine.mesh_to_surface.largest);
    CHECK(rough.surface_to_mesh.upper > 1.02 * rough.surface_to_mesh.largest);
}

TEST_CASE("the surface of a warped quad is its bilinear patch") {
    HexMesh mesh = test::cube(1);
    mesh.positions[7].z += 0.04; // vertex (1,1,1): the top is z = 1 + 0.04 uv
    const Measured original = build(mesh);
    const double allowed = original.model.quad_tolerance();
    CHECK(allowed == Approx(1e-4 * original.model.diagonal()));
    CHECK(measure(mesh, original).bilinear_gap <= allowed);
    double largest = 0, steepest = 0;
    for (double u = 0; u <= 1; u += 1.0 / 64)
        for (double v = 0; v <= 1; v += 1.0 / 64) {
            const Projection p = original.model.project_patch(kNoIndex, Point(u, v, 1 + 0.04 * u * v));
            largest = std::max(largest, p.distance);
            const Point normal = glm::normalize(Point(-0.04 * v, -0.04 * u, 1));
            if (u > 0 && u < 1 && v > 0 && v < 1)
                steepest = std::max(steepest, glm::length(glm::cross(p.smooth_direction, normal)));
        }
    CHECK(largest <= allowed);
    CHECK(largest > 0.1 * allowed);
    CHECK(steepest < 1e-2);
}

TEST_CASE("a quad's deviation is that of its corners, edges and centre") {
    const HexMesh mesh = test::ball(8);
    const Measured original = build(mesh);
    const Quad quad = face_vertices(mesh, original.topology.boundary_faces[10]);
    std::array<Point, 4> x;
    for (int k = 0; k < 4; ++k) x[k] = mesh.positions[quad[k]];
    Index hint = kNoIndex;
    CHECK(original.model.quad_deviation(x, 0, hint) < 1e-15);
    CHECK(original.model.source_face(hint) == 10);
    for (Point& p : x) p *= 1.1;
    const double outside = original.model.quad_deviation(x, 0, hint);
    CHECK(outside == Approx(0.1).epsilon(0.05));
    CHECK(original.model.quad_deviation(x, kNoIndex, hint) == outside);
}
