#include "pipeline/mesh_surface.hpp"
#include "pipeline/seeded_surface.hpp"
#include "support/shapes.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

/// Cubes, each a patch with its number as name.
TriangleSoup cubes(const std::vector<std::array<double, 2>>& ranges) {
    TriangleSoup all;
    for (const auto& [low, high] : ranges) {
        const TriangleSoup cube = make_box_surface(Point(low), Point(high));
        const auto first = static_cast<Index>(all.vertices.size());
        const auto patch = static_cast<Index>(all.patch_names.size());
        all.patch_names.push_back(std::to_string(patch));
        all.vertices.insert(all.vertices.end(), cube.vertices.begin(), cube.vertices.end());
        for (const auto& [a, b, c] : cube.triangles) {
            all.triangles.push_back({first + a, first + b, first + c});
            all.patch.push_back(patch);
        }
    }
    return all;
}

/// The patches that are left.
std::vector<Index> patches_left(const TriangleSoup& soup, std::vector<Point> seeds) {
    Context context(2);
    const auto kept = keep_around_seeds(soup, seeds, context);
    REQUIRE(kept);
    for (const auto& triangle : kept->soup.triangles)
        for (Index v : triangle) REQUIRE(v < kept->soup.vertices.size());
    std::vector<Index> patches = kept->soup.patch;
    std::sort(patches.begin(), patches.end());
    patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
    CHECK(kept->left_out_bodies == soup.patch_names.size() - patches.size());
    return patches;
}

using Numbers = std::vector<Index>;

} // namespace

TEST_CASE("closed surfaces that do not bound the seeds' parts are left out") {
    // 0 holds 1, which holds 2; 3 is apart, and holds nothing.
    const TriangleSoup nested = cubes({{0, 9}, {1, 8}, {2, 7}, {20, 21}});
    CHECK(patches_left(nested, {Point(0.5)}) == Numbers{0, 1});
    CHECK(patches_left(nested, {Point(1.5)}) == Numbers{1, 2});
    CHECK(patches_left(nested, {Point(4)}) == Numbers{2});
    CHECK(patches_left(nested, {Point(20.5)}) == Numbers{3});
    CHECK(patches_left(nested, {Point(4), Point(20.5)}) == Numbers{2, 3});
    CHECK(patches_left(nested, {Point(15)}) == Numbers{0, 1, 2, 3}); // a leak
    CHECK(patches_left(nested, {}) == Numbers{0, 1, 2, 3});
}

TEST_CASE("surfaces that cross and open ones stay") {
    const TriangleSoup crossing = cubes({{0, 4}, {3, 6}, {20, 21}});
    CHECK(patches_left(crossing, {Point(1)}) == Numbers{0, 1});
    CHECK(patches_left(crossing, {Point(5)}) == Numbers{0, 1});
    TriangleSoup open = cubes({{0, 4}, {20, 21}});
    open.triangles.pop_back(), open.patch.pop_back(); // of the second
    CHECK(patches_left(open, {Point(1)}) == Numbers{0, 1});
}

TEST_CASE("a seed in a cavity has it meshed, features and all") {
    MeshOptions options;
    options.refine.target_cells = 500;
    options.trim.seeds = {Point(0.5)};
    StageClock clock;
    Context context(2);
    const auto outcome = mesh_surface(cubes({{-2, 3}, {0, 1}}), options, clock, context);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    CHECK(outcome->left_out_bodies == 1);
    CHECK(outcome->corners == 8);
    CHECK(outcome->fit.captured_corners == 8);
    CHECK(outcome->after.total_volume == Approx(1).epsilon(1e-9));
    CHECK(outcome->deviation.largest() < 1e-9);
}
