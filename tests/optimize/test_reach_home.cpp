#include "stages/optimize/reach_home.hpp"

#include "domain/boundary_model_builder.hpp"
#include "mesh/hanging.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/box_mesh.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

constexpr std::size_t kAll = 1000; ///< more than any of these needs

/// A mesh on its own boundary.
struct OnBoundary {
    HexMesh mesh;
    Topology topology;
    BoundaryModel surface;
    Context context;

    explicit OnBoundary(HexMesh given, int threads = 1) : mesh(std::move(given)), context(threads) {
        topology = compute_topology(mesh);
        auto model = build_boundary_model(mesh, topology, BoundaryOptions{}, context);
        REQUIRE(model);
        surface = std::move(*model);
    }

    double distance(Index v) const {
        return surface.project(surface.associations()[v], mesh.positions[v]).distance;
    }
    Index nearest(const Point& place) const {
        Index best = 0;
        for (Index v = 0; v < mesh.vertex_count(); ++v)
            if (glm::distance(mesh.positions[v], place) < glm::distance(mesh.positions[best], place))
                best = v;
        return best;
    }
    double min_sj() const { return compute_validity(mesh, Parallel(1)).min_scaled_jacobian; }
    void check_sound() const {
        CHECK(compute_validity(mesh, Parallel(1)).is_valid());
        CHECK(find_boundary_contacts(mesh, topology, Parallel(1)).empty());
        HexMesh placed = mesh;
        apply_hanging(placed, Parallel(1));
        for (Index v = 0; v < mesh.vertex_count(); ++v)
            CHECK(glm::distance(placed.positions[v], mesh.positions[v]) < 1e-12);
    }
};

/// A cube of edge 4 in cells of size 1, finer at one corner.
HexMesh make_octree() {
    OctreeOptions options;
    options.levels = 1;
    options.refine = [](Point low, Point) { return low.x < 2 && low.y < 2 && low.z < 2; };
    auto mesh = make_box_mesh(make_octree_boxes(options), lattice_units(options.levels));
    REQUIRE(mesh);
    return std::move(*mesh);
}

} // namespace

TEST_CASE("reach_home: vertices are put to places on their patches and curves, and the rest gives way") {
    OnBoundary cube(make_octree());
    std::mt19937 random(GENERATE(1u, 2u, 3u));
    std::uniform_real_distribution<double> shift(-0.6, 0.6);
    const Index on_patch = cube.nearest({4, 2, 3}), on_curve = cube.nearest({2, 4, 4});
    REQUIRE(cube.surface.associations()[on_patch].kind == EntityKind::patch);
    REQUIRE(cube.surface.associations()[on_curve].kind == EntityKind::curve);
    const Point patch_place = cube.mesh.positions[on_patch] + Point(0, shift(random), shift(random));
    const Point curve_place = cube.mesh.positions[on_curve] + Point(shift(random), 0, 0);
    ReachOptions options;
    options.min_sj = 0.3;
    HomeReacher reacher(cube.mesh, cube.topology, cube.surface, options, cube.context);
    std::size_t most = kAll;
    const auto is_there =
        reacher.put(std::vector<HomeReacher::Place>{{on_patch, patch_place}, {on_curve, curve_place}}, most);
    REQUIRE(is_there == std::vector<std::uint8_t>{1, 1});
    CHECK(cube.mesh.positions[on_patch] == patch_place);
    CHECK(cube.mesh.positions[on_curve] == curve_place);
    CHECK(cube.min_sj() >= 0.3);
    for (Index v = 0; v < cube.mesh.vertex_count(); ++v)
        if (cube.topology.on_boundary[v]) CHECK(cube.distance(v) < 1e-12);
    cube.check_sound();
}

TEST_CASE("reach_home: what would spoil cells leaves the mesh as it was, to the bit") {
    OnBoundary cube(make_octree());
    const std::vector<Point> before = cube.mesh.positions;
    const Index v = cube.nearest({4, 2, 3});
    const auto at = GENERATE(Point(4, 2, 0.2), Point(4, 2, 3.999), Point(4, 0.1, 3));
    ReachOptions options;
    options.min_sj = 0.999;
    HomeReacher reacher(cube.mesh, cube.topology, cube.surface, options, cube.context);
    std::size_t most = kAll;
    CHECK(reacher.put(std::vector<HomeReacher::Place>{{v, at}}, most) == std::vector<std::uint8_t>{0});
    CHECK((cube.mesh.positions == before));
}

TEST_CASE("reach_home: vertices that are off come home, be they alone or many") {
    OnBoundary cube(make_octree());
    std::mt19937 random(GENERATE(1u, 2u, 3u));
    std::uniform_real_distribution<double> shift(-0.15, 0.15);
    std::vector<Index> off;
    for (Index v = 0; v < cube.mesh.vertex_count(); ++v) {
        if (!cube.topology.on_boundary[v] || cube.topology.hanging_row[v] != kNoIndex || random() % 3 > 0)
            continue;
        cube.mesh.positions[v] += Point(shift(random), shift(random), shift(random));
        if (cube.distance(v) > 1e-6) off.push_back(v);
    }
    apply_hanging(cube.mesh, Parallel(1));
    REQUIRE(compute_validity(cube.mesh, Parallel(1)).is_valid());
    REQUIRE(off.size() > 10);
    const double worst = cube.min_sj();
    HomeReacher reacher(cube.mesh, cube.topology, cube.surface, {}, cube.context);
    std::size_t most = kAll;
    CHECK(reacher.reach(off, most) == off.size());
    CHECK(most < kAll);
    for (Index v : off) CHECK(cube.distance(v) < 1e-12);
    CHECK(cube.min_sj() >= std::min(worst, ReachOptions{}.min_sj));
    cube.check_sound();
}

TEST_CASE("reach_home: so many neighbourhoods are tried as may be, and the same for any number of threads") {
    const auto run = [](int threads, std::size_t most) {
        OnBoundary cube(make_octree(), threads);
        std::vector<Index> off;
        for (const Point& place : {Point(4, 2, 3), Point(2, 4, 2), Point(4, 4, 4), Point(0, 0, 4)}) {
            off.push_back(cube.nearest(place));
            cube.mesh.positions[off.back()] += Point(-0.1, -0.15, -0.2);
        }
        apply_hanging(cube.mesh, Parallel(1));
        HomeReacher reacher(cube.mesh, cube.topology, cube.surface, {}, cube.context);
        const std::size_t home = reacher.reach(off, most);
        return std::pair(home, cube.mesh.positions);
    };
    CHECK(run(1, 0).first == 0);
    CHECK(run(1, 2).first == 2);
    const auto [home, positions] = run(1, kAll);
    CHECK(home == 4);
    CHECK(run(3, kAll).second == positions);
}

TEST_CASE("reach_home: a cancelled run changes nothing") {
    OnBoundary cube(make_octree());
    const Index v = cube.nearest({4, 2, 3});
    const std::vector<Point> before = cube.mesh.positions;
    cube.context.cancel();
    HomeReacher reacher(cube.mesh, cube.topology, cube.surface, {}, cube.context);
    std::size_t most = kAll;
    CHECK(reacher.put(std::vector<HomeReacher::Place>{{v, {4, 2.2, 3.2}}}, most) ==
          std::vector<std::uint8_t>{0});
    CHECK((cube.mesh.positions == before));
}
