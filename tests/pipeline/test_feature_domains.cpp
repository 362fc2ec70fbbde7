#include "pipeline/feature_domains.hpp"

#include "mesh/hex_reference.hpp"
#include "samples/grid.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

constexpr Index kSide = 8;

Domain cube_domain(Context& context) {
    TriangleSoup soup;
    for (int v = 0; v < 8; ++v)
        soup.vertices.push_back(static_cast<double>(kSide) *
                                Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]));
    for (const auto& f : hex::kFaceVertex) {
        soup.triangles.push_back({f[0], f[1], f[2]});
        soup.triangles.push_back({f[0], f[2], f[3]});
    }
    return *build_domain(soup, {}, context);
}

/// A grid fitted to the cube of which the given cells failed.
MeshAttempt attempt_on(const Domain& domain, std::vector<Index> failed, Context& context) {
    HexMesh grid = *make_grid({.cells = {kSide, kSide, kSide}, .high = Point(kSide)}, context.parallel());
    MeshAttempt attempt;
    attempt.fitted = fit_boundary(std::move(grid), domain, {}, context)->fitted;
    attempt.topology = compute_topology(attempt.fitted.mesh, context.parallel());
    attempt.failed = std::move(failed);
    return attempt;
}

/// The curve along x at y = z = 0.
Index front_curve(const Domain& domain) {
    return domain.model.curve_of_segment(domain.model.project_curve(kNoIndex, Point(4, 0, 0)).element);
}

} // namespace

TEST_CASE("features are noise only where they are blunt and cells fail along a good part of them") {
    Context context(1);
    Domain whole = cube_domain(context);
    const MeshAttempt at_edge = attempt_on(whole, {3, 4}, context); // at y = z = 0
    const Index front = front_curve(whole);
    CHECK(find_noisy_curves(at_edge, whole, whole, 60).empty());
    CHECK(find_noisy_curves(at_edge, whole, whole, 100) == std::vector<Index>{front});
    const MeshAttempt inside = attempt_on(whole, {kSide * kSide * 4 + kSide * 4 + 4}, context);
    CHECK(find_noisy_curves(inside, whole, whole, 100).empty());
    // A cell at the end of curves is next to three of nine vertices on each, fewer than a quarter of none.
    const MeshAttempt at_corner = attempt_on(whole, {0}, context);
    CHECK(find_noisy_curves(at_corner, whole, whole, 100).size() == 3);

    SECTION("between patches of two names they stay") {
        const auto patches = whole.curve_patch[front];
        whole.names = {"one", "two"};
        std::fill(whole.patch_name.begin(), whole.patch_name.end(), 0);
        CHECK(find_noisy_curves(at_edge, whole, whole, 100).size() == 1);
        whole.patch_name[patches[0]] = 1;
        CHECK(find_noisy_curves(at_edge, whole, whole, 100).empty());
    }
    SECTION("open ones too") {
        whole.curve_open[front] = 1;
        CHECK(find_noisy_curves(at_edge, whole, whole, 100).empty());
    }
}

TEST_CASE("attempts without some curves number those that are left as the whole domain does") {
    Context context(1);
    Domain whole = cube_domain(context);
    FeatureDomains domains(whole);
    CHECK(*domains.without({}, context) == &whole);
    const Index front = front_curve(whole);
    for (Index dropped = 0; dropped < 12; ++dropped) {
        if (dropped == front) continue;
        const auto own = domains.without(std::array{dropped}, context);
        REQUIRE(own);
        CHECK((*own)->model.curve_count() == 11);
        MeshAttempt attempt = attempt_on(**own, {3, 4}, context);
        attempt.dropped = {dropped};
        CHECK(find_noisy_curves(attempt, **own, whole, 100) == std::vector<Index>{front});
        const std::vector<Index> at_front = {front}, elsewhere = {dropped};
        CHECK(cells_elsewhere(attempt.failed, attempt, **own, whole, at_front).empty());
        CHECK(cells_elsewhere(attempt.failed, attempt, **own, whole, elsewhere) == attempt.failed);
    }
}

TEST_CASE("what is left of a domain is found in the one without some more curves") {
    Context context(1);
    Domain whole = cube_domain(context);
    FeatureDomains domains(whole);
    const Index front = front_curve(whole);
    const Index first = front == 0 ? 1 : 0;
    std::vector<Index> from = {first}, to = {std::min(first, front), std::max(first, front)};
    const auto map = domains.map(from, to, context);
    REQUIRE(map);
    const Domain before = **domains.without(from, context), after = **domains.without(to, context);
    const auto at = [](const Domain& domain, const Point& p) {
        return Association{EntityKind::patch,
                           domain.model.patch_of_triangle(domain.model.project_patch(kNoIndex, p).element)};
    };
    for (const Point& p :
         {Point(4, 4, 0), Point(4, 0, 4), Point(8, 3, 4), Point(0, 4, 4), Point(4, 8, 4), Point(4, 4, 8)})
        CHECK((*map)(at(before, p)) == at(after, p));
    for (Index c = 0; c < before.model.curve_count(); ++c) {
        const Point middle = before.model.segment(before.model.project_curve(c, Point(4)).element)[0];
        const Association found = (*map)({EntityKind::curve, c});
        if (before.model.curve_points(c).front().y == 0 && before.model.curve_points(c).back().y == 0 &&
            before.model.curve_points(c).front().z == 0 && before.model.curve_points(c).back().z == 0)
            CHECK(found.entity == kNoIndex);
        else
            CHECK(after.model.project_curve(found.entity, middle).distance == 0);
    }
    for (Index c = 0; c < before.model.corner_count(); ++c) {
        const Association found = (*map)({EntityKind::corner, c});
        if (found.entity != kNoIndex)
            CHECK(after.model.corner_point(found.entity) == before.model.corner_point(c));
    }
    CHECK((*map)({}) == Association{});

    SECTION("a patch that is several there is none") {
        const auto back = domains.map(to, from, context);
        REQUIRE(back);
        CHECK((*back)(at(after, Point(4, 4, 0))).entity == kNoIndex);
        CHECK((*back)(at(after, Point(4, 0, 4))).entity == kNoIndex);
    }
}
