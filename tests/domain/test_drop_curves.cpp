#include "domain/drop_curves.hpp"

#include "domain/narrow_curves.hpp"
#include "mesh/hex_reference.hpp"

#include <catch2/catch.hpp>
#include <numeric>

using namespace hexopt;

namespace {

Result<Domain> cube_domain(Context& context) {
    TriangleSoup soup;
    for (int v = 0; v < 8; ++v)
        soup.vertices.emplace_back(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]);
    for (const auto& f : hex::kFaceVertex) {
        soup.triangles.push_back({f[0], f[1], f[2]});
        soup.triangles.push_back({f[0], f[2], f[3]});
    }
    return build_domain(soup, {}, context);
}

} // namespace

TEST_CASE("borders between patches of one group are features by their shape alone, and may be given up") {
    Context context(1);
    TriangleSoup soup;
    for (int v = 0; v < 8; ++v)
        soup.vertices.emplace_back(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]);
    for (const auto& f : hex::kFaceVertex) { // each face of the cube is two patches
        soup.triangles.push_back({f[0], f[1], f[2]});
        soup.triangles.push_back({f[0], f[2], f[3]});
        for (int k = 0; k < 2; ++k) {
            soup.patch.push_back(static_cast<Index>(soup.patch_names.size()));
            soup.patch_names.push_back("face_" + std::to_string(soup.patch_names.size() + 1));
        }
    }
    const auto own = build_domain(soup, {}, context);
    REQUIRE(own);
    CHECK(own->model.curve_count() == 18);
    CHECK_FALSE(may_give_up(*own, 0, 180));

    soup.patch_group.assign(12, 0);
    const auto joined = build_domain(soup, {}, context);
    REQUIRE(joined);
    CHECK(joined->model.curve_count() == 12);
    CHECK(joined->model.patch_count() == 6);
    CHECK(joined->triangle_name.size() == 12); // every triangle keeps its name
    const auto less = drop_curves(*joined, std::array{Index{3}}, context);
    REQUIRE(less);
    for (Index c = 0; c < less->model.curve_count(); ++c) {
        CHECK(may_give_up(*joined, c, 100));
        CHECK(may_give_up(*less, c, 100));
    }

    soup.patch_group[0] = soup.patch_group[1] = 1; // a side of the cube that has a name
    const auto named = build_domain(soup, {}, context);
    REQUIRE(named);
    CHECK(named->model.curve_count() == 12);
    const auto fewer = drop_curves(*named, std::array{Index{11}}, context);
    REQUIRE(fewer);
    std::size_t kept = 0;
    for (Index c = 0; c < 11; ++c) {
        CHECK(may_give_up(*named, c, 100) == may_give_up(*fewer, c, 100));
        kept += !may_give_up(*named, c, 100);
    }
    kept += !may_give_up(*named, 11, 100);
    CHECK(kept == 4);

    soup.patch_group.pop_back();
    CHECK(build_domain(soup, {}, context).error().code == ErrorCode::bad_input);
}

TEST_CASE("dropping one curve of a cube joins its two patches and leaves the rest") {
    Context context(1);
    const auto cube = cube_domain(context);
    REQUIRE(cube);
    for (Index c = 0; c < 12; ++c) {
        CAPTURE(c);
        const auto less = drop_curves(*cube, std::array{c}, context);
        REQUIRE(less);
        CHECK(less->model.curve_count() == 11);
        CHECK(less->model.corner_count() == 8);
        CHECK(less->model.patch_count() == 5);
        CHECK(less->model.triangle_count() == cube->model.triangle_count());
        for (Index k = 0; k < 11; ++k) { // they keep their order
            const auto old = cube->model.curve_points(k < c ? k : k + 1);
            const auto left = less->model.curve_points(k);
            CHECK(std::vector<Point>(left.begin(), left.end()) == std::vector<Point>(old.begin(), old.end()));
            CHECK(less->angle[k].smallest == Approx(90));
            CHECK(less->curve_patch[k].size() == 2);
        }
        // What was dropped lies inside the joined patch.
        const auto ends = cube->model.curve_points(c);
        const Point middle = 0.5 * (ends.front() + ends.back());
        const auto beside = cube->curve_patch[c];
        const Index joined =
            less->model.patch_of_triangle(less->model.project_patch(kNoIndex, middle).element);
        std::size_t triangles = 0;
        for (Index p : beside) {
            const auto [first, last] = cube->model.patch_triangles(p);
            triangles += last - first;
        }
        const auto [first, last] = less->model.patch_triangles(joined);
        CHECK(last - first == triangles);
    }
}

TEST_CASE("dropping all curves leaves one patch without corners") {
    Context context(1);
    const auto cube = cube_domain(context);
    REQUIRE(cube);
    std::vector<Index> all(12);
    std::iota(all.begin(), all.end(), Index{0});
    const auto less = drop_curves(*cube, all, context);
    REQUIRE(less);
    CHECK(less->model.curve_count() == 0);
    CHECK(less->model.corner_count() == 0);
    CHECK(less->model.patch_count() == 1);
    const auto none = drop_curves(*cube, {}, context);
    REQUIRE(none);
    CHECK(none->model.curve_count() == 12);
    CHECK(none->model.patch_count() == 6);
}
