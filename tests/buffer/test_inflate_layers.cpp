#include "buffer/fitted_shapes.hpp"
#include "stages/buffer/inflate_layers.hpp"

using namespace hexopt;
using namespace hexopt::test;

namespace {

FittedShape buffered_cube() {
    FittedShape shape = make_cube(6);
    Context context(1);
    auto buffered = insert_buffers(std::move(shape.fitted), shape.domain, {}, context);
    REQUIRE(buffered);
    shape.fitted = std::move(buffered->fitted);
    return shape;
}

} // namespace

TEST_CASE("inflate: layers spread to an even lattice, boundary on its entities") {
    FittedShape shape = buffered_cube();
    const std::vector<Point> before = shape.fitted.mesh.positions;
    Context context(1);
    REQUIRE(inflate_layers(shape.fitted, shape.domain, {200, 200, 6}, context));
    const HexMesh& mesh = shape.fitted.mesh;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const Projection at = shape.domain.model.project(shape.fitted.association[v], mesh.positions[v]);
        CHECK(at.distance < 1e-12);
        if (shape.fitted.association[v].kind == EntityKind::corner) CHECK(mesh.positions[v] == before[v]);
    }
    // A cube whose layers leave through convex edges is a lattice again: every edge comes to the same length.
    double shortest = 1e300, longest = 0;
    for (const Cell& cell : mesh.cells)
        for (const auto& e : hex::kEdgeVertex) {
            const double length = glm::distance(mesh.positions[cell[e[0]]], mesh.positions[cell[e[1]]]);
            shortest = std::min(shortest, length);
            longest = std::max(longest, length);
        }
    CHECK(longest / shortest == Approx(1).margin(0.02));
}

TEST_CASE("inflate: nothing moves with no sweeps; same bits for any number of threads; cancelled") {
    FittedShape shape = buffered_cube();
    const std::vector<Point> before = shape.fitted.mesh.positions;
    Context context(1);
    REQUIRE(inflate_layers(shape.fitted, shape.domain, {0, 0, 1}, context));
    CHECK(shape.fitted.mesh.positions == before);
    std::vector<Point> first;
    for (int threads : {1, 3}) {
        FittedShape again = buffered_cube();
        Context many(threads);
        REQUIRE(inflate_layers(again.fitted, again.domain, {}, many));
        if (first.empty()) first = again.fitted.mesh.positions;
        CHECK(first == again.fitted.mesh.positions);
    }
    context.cancel();
    CHECK(!inflate_layers(shape.fitted, shape.domain, {}, context));
}
