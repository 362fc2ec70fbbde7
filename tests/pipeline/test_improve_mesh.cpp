#include "pipeline/improve_mesh.hpp"
#include "pipeline/tangled_mesh.hpp"

using namespace hexopt;
using hexopt::test::tangled_mesh;

namespace {

Result<ImproveOutcome> improve(HexMesh& mesh, BoundaryMode mode, int threads = 1) {
    ImproveOptions options;
    options.optimize.boundary = mode;
    StageClock clock;
    Context context(threads);
    return improve_mesh(mesh, options, clock, context);
}

} // namespace

TEST_CASE("a tangled mesh becomes valid, and before and after are measured") {
    HexMesh mesh = tangled_mesh("grid", 0.2, 6);
    const auto outcome = improve(mesh, BoundaryMode::fixed);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    CHECK(outcome->before.validity.concave_cells > 0);
    CHECK(outcome->after.validity.is_valid());
    CHECK(outcome->stats->bad32_before == outcome->before.validity.concave_cells);
    CHECK(outcome->stats->min_sj_after == Approx(outcome->after.validity.min_scaled_jacobian).margin(1e-9));
    CHECK_FALSE(outcome->deviation);
}

TEST_CASE("sliding stays on the cube's faces and says so") {
    HexMesh mesh = tangled_mesh("grid", 0.2, 6);
    const auto outcome = improve(mesh, BoundaryMode::slide);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    REQUIRE(outcome->deviation);
    CHECK(outcome->deviation->largest_rel() < 1e-12);
}

TEST_CASE("hanging vertices that the mesh does not name are recognised and kept in place") {
    HexMesh mesh = tangled_mesh("octree-corner", 0);
    const std::size_t hanging = mesh.hanging.count();
    REQUIRE(hanging > 0);
    mesh.hanging.clear();
    ++mesh.revision;
    const auto outcome = improve(mesh, BoundaryMode::fixed);
    REQUIRE(outcome);
    CHECK(outcome->recognised_hanging == hanging);
    CHECK(outcome->before.hanging_vertices == hanging);
    CHECK(outcome->after.validity.is_valid());
}

TEST_CASE("a target that is not met gives below_target, one that is met gives ok") {
    for (const auto& [target, verdict] : {std::pair{0.999, ErrorCode::below_target}, {0.2, ErrorCode::ok}}) {
        HexMesh mesh = tangled_mesh("grid-warped", 0.1, 6);
        ImproveOptions options;
        options.optimize.boundary = BoundaryMode::fixed;
        options.target_min_sj = options.optimize.min_sj = target;
        StageClock clock;
        Context context(1);
        const auto outcome = improve_mesh(mesh, options, clock, context);
        REQUIRE(outcome);
        CHECK(outcome->verdict == verdict);
    }
}

TEST_CASE("a cell that the fixed boundary turns inside out gives no_valid_mesh") {
    HexMesh mesh = tangled_mesh("grid", 0, 1);
    std::swap(mesh.positions[0], mesh.positions[1]);
    const auto outcome = improve(mesh, BoundaryMode::fixed);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::no_valid_mesh);
    CHECK(outcome->after.validity.valid == 0);
}

TEST_CASE("cancelling on the way keeps what was reached, cancelling before leaves the mesh alone") {
    const HexMesh input = tangled_mesh("scrambled-cube", 0, 8);
    HexMesh mesh = input;
    ImproveOptions options;
    options.optimize.boundary = BoundaryMode::fixed;
    StageClock clock;
    Context context(1);
    context.set_progress_sink([&](std::string_view stage, double, std::string_view) {
        if (stage == "max-min") context.cancel();
    });
    const auto outcome = improve_mesh(mesh, options, clock, context);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::cancelled);
    CHECK(outcome->after.validity.concave_cells <= outcome->before.validity.concave_cells);

    HexMesh untouched = input;
    Context cancelled(1);
    cancelled.cancel();
    const auto none = improve_mesh(untouched, options, clock, cancelled);
    REQUIRE_FALSE(none);
    CHECK(none.error().code == ErrorCode::cancelled);
    CHECK(untouched.positions == input.positions);
}

TEST_CASE("the number of threads changes no bit") {
    HexMesh one = tangled_mesh("octree-sphere", 0.2), two = one;
    REQUIRE(improve(one, BoundaryMode::slide, 1));
    REQUIRE(improve(two, BoundaryMode::slide, 2));
    CHECK(one.positions == two.positions);
}

TEST_CASE("a mesh without cells is refused") {
    HexMesh mesh;
    const auto outcome = improve(mesh, BoundaryMode::fixed);
    REQUIRE_FALSE(outcome);
    CHECK(outcome.error().code == ErrorCode::bad_input);
}
