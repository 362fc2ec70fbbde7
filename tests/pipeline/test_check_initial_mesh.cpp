#include "pipeline/check_initial_mesh.hpp"
#include "pipeline/prepare_domain.hpp"
#include "samples/grid.hpp"
#include "samples/samples.hpp"
#include "support/shapes.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

/// What check_initial_mesh() says of the unit cube: empty where nothing.
std::string check(const MeshOptions& options, ErrorCode code) {
    StageClock clock;
    Context context(2);
    const auto prepared = prepare_domain(make_box_surface(Point(0), Point(1)), options, clock, context);
    REQUIRE(prepared);
    const Status status = check_initial_mesh(prepared->domain, options, context);
    if (status) return {};
    CHECK(status.error().code == code);
    return status.error().one_line();
}

std::string check_box(const Point& low, const Point& high, std::vector<Point> seeds = {}) {
    MeshOptions options;
    options.refine.initial.box = Box{low, high};
    options.trim.seeds = std::move(seeds);
    return check(options, ErrorCode::usage);
}

std::string check_mesh(HexMesh mesh, std::vector<Point> seeds = {}) {
    MeshOptions options;
    options.refine.initial.mesh = std::move(mesh);
    options.trim.seeds = std::move(seeds);
    return check(options, ErrorCode::bad_input);
}

HexMesh grid(const Point& low, const Point& high) {
    return *make_grid({.cells = {4, 4, 4}, .low = low, .high = high}, Parallel(1));
}

} // namespace

TEST_CASE("a box to start from encloses the surface") {
    CHECK(check_box(Point(-0.1), Point(1.1)).empty());
    CHECK(check_box(Point(0), Point(1)).empty());
    CHECK(check_box(Point(0), Point(2, 2, 0.9)).find(", 1) of the surface") != std::string::npos);
    CHECK(check_box(Point(0, 0.1, 0), Point(2)).find("--box") != std::string::npos);
    CHECK(check_box(Point(0), Point(0.5), {Point(0.2)}).empty());
}

TEST_CASE("a mesh to start from encloses the surface") {
    CHECK(check_mesh(grid(Point(-1), Point(2))).empty());
    CHECK(check_mesh(grid(Point(0), Point(1))).empty());
    CHECK(check_mesh(grid(Point(0.05), Point(0.95))).empty()); // by less than half of its edge
    CHECK(check_mesh(grid(Point(0.2), Point(0.8))).find("of the surface is not inside") != std::string::npos);
    CHECK(check_mesh(grid(Point(0.2), Point(0.8)), {Point(0.5)}).empty());
    CHECK(check_mesh(grid(Point(0), Point(1, 1, 0.5))).find("of the surface is not inside") !=
          std::string::npos);
    Context context(1);
    for (const char* name : {"octree-sphere", "octree-corner"}) {
        const auto octree = make_sample(name, {}, context);
        REQUIRE(octree);
        CHECK(check_mesh(*octree).empty());
    }
}

TEST_CASE("a mesh to start from has no cells that are turned over") {
    HexMesh mesh = grid(Point(-1), Point(2));
    const Index inner = 1 + 5 + 25;
    mesh.positions[inner] = Point(0.6, -0.25, -0.25); // across the next layer of cells
    const std::string error = check_mesh(mesh, {Point(0.5)});
    INFO(error);
    CHECK(error.find("of 64 cells are concave") != std::string::npos);
    CHECK(error.find(" at (") != std::string::npos);
}
