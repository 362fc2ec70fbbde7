// The result does not depend on where a mesh lies, in which unit it is given or how it is numbered.
#include "domain/boundary_model.hpp"
#include "mesh/random_remap.hpp"
#include "mesh/topology.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/optimize.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace hexopt;

namespace {

struct Case {
    const char* name;
    Index size;
    int levels;
    double tangled;
};

HexMesh make_case(const Case& c) {
    SampleOptions options;
    options.size = c.size;
    options.levels = c.levels;
    options.tangled = c.tangled;
    options.scrambled = c.tangled == 0;
    Context context(1, 7);
    Result<HexMesh> mesh = make_sample(c.name, options, context);
    REQUIRE(mesh);
    return std::move(*mesh);
}

/// Measured anew, not by the optimizer.
ValidityCounts optimized(HexMesh mesh, BoundaryMode boundary) {
    Context context(2);
    const Topology topology = compute_topology(mesh);
    const auto surface = build_boundary_model(mesh, topology, {}, context);
    REQUIRE(surface);
    OptimizeOptions options;
    options.boundary = boundary;
    const auto stats = optimize(mesh, topology, &*surface, options, context);
    REQUIRE(stats);
    return compute_validity(mesh, context.parallel());
}

/// Columns of a random rotation: a unit quaternion, uniform over all rotations (Shoemake 1992).
std::array<Point, 3> random_rotation(Random& random) {
    const double u = random.uniform(), a = random.uniform(0, 2 * M_PI), b = random.uniform(0, 2 * M_PI);
    const double x = std::sqrt(1 - u) * std::sin(a), y = std::sqrt(1 - u) * std::cos(a);
    const double z = std::sqrt(u) * std::sin(b), w = std::sqrt(u) * std::cos(b);
    return {Point(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
            Point(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
            Point(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))};
}

HexMesh moved_rigidly(HexMesh mesh, std::uint64_t seed) {
    Random random(seed);
    const std::array<Point, 3> axis = random_rotation(random);
    const Point shift(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    for (Point& p : mesh.positions) p = shift + p.x * axis[0] + p.y * axis[1] + p.z * axis[2];
    return mesh;
}

HexMesh scaled(HexMesh mesh, double factor) {
    for (Point& p : mesh.positions) p *= factor;
    return mesh;
}

void check_same(const ValidityCounts& result, const ValidityCounts& reference) {
    CHECK(result.concave8_cells == reference.concave8_cells);
    CHECK(result.concave_cells == reference.concave_cells);
    CHECK(result.valid == reference.valid);
    CHECK(result.min_scaled_jacobian == Approx(reference.min_scaled_jacobian).margin(0.02).epsilon(0));
}

} // namespace

TEST_CASE("the place, unit and numbering change nothing about the result", "[slow]") {
    const Case c = GENERATE(Case{"scrambled-cube", 7, -1, 0}, Case{"octree-warped", 4, 2, 0.2},
                            Case{"grid-warped", 8, -1, 0.3});
    const BoundaryMode boundary = GENERATE(BoundaryMode::fixed, BoundaryMode::slide);
    CAPTURE(c.name, boundary == BoundaryMode::slide);
    const HexMesh mesh = make_case(c);
    REQUIRE(compute_validity(mesh, Parallel(1)).concave_cells > mesh.cell_count() / 10);
    const ValidityCounts reference = optimized(mesh, boundary);
    CHECK(reference.is_valid());

    for (const std::uint64_t seed : {1, 2}) {
        CAPTURE(seed);
        const auto check = [&](const char* change, HexMesh changed) {
            CAPTURE(change);
            check_same(optimized(std::move(changed), boundary), reference);
        };
        check("rigid motion", moved_rigidly(mesh, seed));
        check("unit of length", scaled(mesh, seed == 1 ? 1e6 : 1e-6));
        check("numbering of vertices and cells", apply_remap(mesh, test::random_remap(mesh, seed)));
        HexMesh turned = mesh;
        test::turn_cells(turned, seed);
        check("numbering inside the cells", std::move(turned));
    }
}
