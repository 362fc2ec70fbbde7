#include "pipeline/rescue_mesh.hpp"

#include "quality/mesh_validity.hpp"
#include "refine/surfaces.hpp"
#include "samples/geometry/solid.hpp"
#include "stages/refine/refine.hpp"

#include <catch2/catch.hpp>

namespace hexopt {

namespace {

/// A box meshed up to its first attempt, of which some cells are turned inside out then.
struct Broken {
    StageClock clock;
    Context context{2};
    Domain domain;
    MeshOptions options;
    std::optional<MeshState> state;

    Broken() {
        auto built =
            build_domain(geometry::make_box(Point(0), Point(2), {"a", "b", "c", "d", "e", "f"}), {}, context);
        REQUIRE(built);
        domain = std::move(*built);
        options.refine.surface.size = 0.5;
        auto refined = refine(domain, options.refine, context);
        REQUIRE(refined);
        state.emplace(std::move(*refined));
        auto attempt =
            begin_attempt(state->octree, domain, domain, options, state->counts, clock, context, nullptr);
        REQUIRE(attempt);
        REQUIRE(optimize_attempt(*attempt, std::nullopt, domain, options, {}, state->counts, clock, context));
        REQUIRE(attempt->failed.empty());
        HexMesh& mesh = attempt->fitted.mesh;
        const Point middle = mesh.positions[mesh.cells[0][6]];
        for (Index v : mesh.cells[0]) mesh.positions[v] = 2.0 * middle - mesh.positions[v];
        grade_cells(*attempt, context.parallel());
        REQUIRE_FALSE(attempt->failed.empty());
        state->attempts.push_back({mesh.cell_count(), attempt->failed.size(), 0});
        state->best = std::move(*attempt);
    }

    Status rescue() { return rescue_mesh(*state, domain, domain, options, {}, clock, context); }
};

} // namespace

TEST_CASE("what settling leaves bad is meshed anew with smaller cells there") {
    Broken broken;
    const std::size_t before = broken.state->best->fitted.mesh.cell_count();
    REQUIRE(broken.rescue());
    const MeshAttempt& best = *broken.state->best;
    CHECK(best.failed.empty());
    CHECK(compute_validity(best.fitted.mesh, Parallel(1)).is_valid());
    CHECK(best.buffer);
    CHECK(best.fitted.mesh.cell_count() > before);
    REQUIRE(broken.state->attempts.size() == 2);
    CHECK(broken.state->attempts[0].refined > 0);
    CHECK(broken.state->attempts[1].failed == 0);
    const std::span<const Association> bound = broken.domain.model.associations();
    CHECK(bound.size() == best.fitted.mesh.vertex_count());
}

TEST_CASE("where no smaller cells are allowed what is bad is meshed anew without buffer layers") {
    Broken broken;
    broken.options.refine.max_cells = 1;
    REQUIRE(broken.rescue());
    const MeshAttempt& best = *broken.state->best;
    CHECK(best.failed.empty());
    CHECK_FALSE(best.buffer);
    CHECK(compute_validity(best.fitted.mesh, Parallel(1)).is_valid());
}

TEST_CASE("nothing is meshed anew where no cell fails, no repairs are wanted, the time is spent or all was "
          "cancelled") {
    Broken broken;
    const std::size_t failed = broken.state->best->failed.size();
    SECTION("time") { broken.options.optimize.time_limit_s = 0; }
    SECTION("repairs") { broken.options.repairs = 0; }
    SECTION("no failure") { broken.state->best->failed.clear(); }
    SECTION("cancelled") {
        broken.context.cancel();
        REQUIRE(broken.rescue());
        CHECK_FALSE(broken.state->best->stats);
        CHECK(broken.state->best->failed.size() == failed);
        return;
    }
    const std::vector<Point> positions = broken.state->best->fitted.mesh.positions;
    REQUIRE(broken.rescue());
    CHECK(broken.state->best->fitted.mesh.positions == positions);
    CHECK(broken.state->attempts.size() == 1);
}

} // namespace hexopt
