#include "pipeline/carry_positions.hpp"

#include "core/random.hpp"
#include "samples/grid.hpp"

#include <catch2/catch.hpp>

namespace hexopt {

namespace {

constexpr Index kSize = 16;

Index id(Index i, Index j, Index k) { return i + (kSize + 1) * (j + (kSize + 1) * k); }

/// A cube of unit cells.
MeshAttempt make_attempt() {
    MeshAttempt attempt;
    HexMesh& mesh = attempt.fitted.mesh;
    mesh = *make_grid({.cells = {kSize, kSize, kSize}, .high = Point(kSize)}, Parallel(1));
    attempt.fitted.association.resize(mesh.vertex_count());
    attempt.fitted.unfitted = attempt.start = mesh.positions;
    attempt.topology = compute_topology(mesh);
    return attempt;
}

/// As an optimizer might have left it.
MeshAttempt make_moved() {
    MeshAttempt attempt = make_attempt();
    Random random(7);
    for (Point& p : attempt.fitted.mesh.positions)
        for (int k = 0; k < 3; ++k) p[k] += 0.2 * random.uniform() - 0.1;
    return attempt;
}

std::size_t count_carried(const std::vector<std::uint8_t>& cells) {
    return static_cast<std::size_t>(std::count(cells.begin(), cells.end(), 1));
}

} // namespace

TEST_CASE("the same mesh goes on from where it was") {
    const MeshAttempt earlier = make_moved();
    MeshAttempt now = make_attempt();
    for (Point& p : now.start) p.x += 1e-9; // layers are relaxed in another order
    const auto carried = carry_positions(earlier, {}, now, Parallel(1));
    CHECK(count_carried(carried) == now.fitted.mesh.cell_count());
    CHECK(now.fitted.mesh.positions == earlier.fitted.mesh.positions);
}

TEST_CASE("what failed and what is round it starts anew") {
    MeshAttempt earlier = make_moved();
    earlier.failed = {0};
    MeshAttempt now = make_attempt();
    const auto carried = carry_positions(earlier, {}, now, Parallel(1));
    const auto& x = now.fitted.mesh.positions;
    for (Index v : {id(0, 0, 0), id(1, 1, 1), id(3, 3, 3)}) CHECK(x[v] == now.start[v]);
    CHECK(x[id(kSize, kSize, kSize)] == earlier.fitted.mesh.positions[id(kSize, kSize, kSize)]);
    CHECK(carried[0] == 0);
    CHECK(carried.back() == 1);
    // Every cell that counts as carried is where it was, whole.
    for (Index c = 0; c < carried.size(); ++c)
        for (Index v : now.fitted.mesh.cells[c])
            if (carried[c]) CHECK(x[v] == earlier.fitted.mesh.positions[v]);
}

TEST_CASE("vertices bound to something else, or elsewhere, start anew") {
    const MeshAttempt earlier = make_moved();
    MeshAttempt now = make_attempt();
    const Index bound = id(0, 0, 0), away = id(kSize, 0, 0);
    now.fitted.association[bound] = {EntityKind::patch, 3};
    now.start[away].x += 0.5;
    now.fitted.mesh.positions = now.start;
    carry_positions(earlier, {}, now, Parallel(1));
    CHECK(now.fitted.mesh.positions[bound] == now.start[bound]);
    CHECK(now.fitted.mesh.positions[away] == now.start[away]);
    CHECK(now.fitted.mesh.positions[id(0, kSize, kSize)] ==
          earlier.fitted.mesh.positions[id(0, kSize, kSize)]);
}

TEST_CASE("nothing is carried over from another mesh") {
    MeshAttempt earlier = make_moved();
    for (Point& p : earlier.fitted.unfitted) p.x += 0.25;
    MeshAttempt now = make_attempt();
    CHECK(carry_positions(earlier, {}, now, Parallel(1)).empty());
    CHECK(now.fitted.mesh.positions == now.start);
}

TEST_CASE("cells across the border of what is carried are left to the optimizer") {
    MeshAttempt earlier = make_moved();
    for (Point& p : earlier.fitted.mesh.positions) p.x += 0.9; // valid in itself, not beside the start
    earlier.failed = {0};
    MeshAttempt now = make_attempt();
    const auto carried = carry_positions(earlier, {}, now, Parallel(2));
    for (Index c = 0; c < carried.size(); ++c) {
        if (!carried[c]) continue;
        for (Index v : now.fitted.mesh.cells[c])
            CHECK(now.fitted.mesh.positions[v] == earlier.fitted.mesh.positions[v]);
    }
    CHECK(count_carried(carried) < carried.size());
}

TEST_CASE("what is bound to the same under another number is the same") {
    MeshAttempt earlier = make_moved();
    MeshAttempt now = make_attempt();
    const Index same = id(kSize, kSize, kSize), other = id(0, 0, kSize);
    earlier.fitted.association[same] = earlier.fitted.association[other] = {EntityKind::curve, 2};
    now.fitted.association[same] = {EntityKind::curve, 1};
    now.fitted.association[other] = {EntityKind::curve, 2};
    const EntityMap entities{{}, {0, kNoIndex, 1}, {}};
    carry_positions(earlier, entities, now, Parallel(1));
    CHECK(now.fitted.mesh.positions[same] == earlier.fitted.mesh.positions[same]);
    CHECK(now.fitted.mesh.positions[other] == now.start[other]);
}

} // namespace hexopt
