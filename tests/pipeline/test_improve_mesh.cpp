#include "pipeline/improve_mesh.hpp"

#include "core/random.hpp"
#include "mesh/remap.hpp"
#include "pipeline/tangled_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

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

namespace {

struct Changed {
    HexMesh mesh;
    TriangleSoup surface;
};

/// Turned, moved and scaled; vertices and cells in the opposite order.
Changed change(const HexMesh& mesh, const TriangleSoup& surface, std::uint64_t seed) {
    Random random(seed);
    const glm::dquat turn = glm::normalize(glm::dquat(random.uniform(-1, 1), random.uniform(-1, 1),
                                                      random.uniform(-1, 1), random.uniform(-1, 1)));
    const Point shift(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    const double factor = seed % 2 ? 1e6 : 1e-6;
    Remap remap = identity_remap(mesh);
    std::reverse(remap.vertex_old2new.begin(), remap.vertex_old2new.end());
    std::reverse(remap.cell_old2new.begin(), remap.cell_old2new.end());
    Changed changed{apply_remap(mesh, remap), surface};
    for (auto* points : {&changed.mesh.positions, &changed.surface.vertices})
        for (Point& p : *points) p = factor * (turn * p + shift);
    return changed;
}

} // namespace

TEST_CASE("a sliding boundary ends the same wherever the mesh lies, in any unit and numbering") {
    const auto [name, given, deviation] =
        GENERATE(std::tuple{"grid-warped", false, 0.0}, std::tuple{"grid-warped", true, 0.01},
                 std::tuple{"octree-ball", false, 0.0});
    CAPTURE(name, given, deviation);
    const HexMesh mesh = tangled_mesh(name, 0.3, 3);
    const TriangleSoup surface = boundary_soup(mesh, compute_topology(mesh));
    const auto run = [&](HexMesh& improved, const TriangleSoup& soup) {
        ImproveOptions options;
        options.optimize.max_deviation_rel = deviation;
        if (given) options.surface = &soup;
        StageClock clock;
        Context context(2);
        const auto outcome = improve_mesh(improved, options, clock, context);
        REQUIRE(outcome);
        CHECK(outcome->stats->min_sj_after ==
              Approx(outcome->after.validity.min_scaled_jacobian).margin(1e-9));
        return outcome->after;
    };
    HexMesh as_it_is = mesh;
    const QualityReport reference = run(as_it_is, surface);
    REQUIRE(reference.validity.is_valid());
    for (const std::uint64_t seed : {1, 2}) {
        Changed changed = change(mesh, surface, seed);
        const QualityReport after = run(changed.mesh, changed.surface);
        CHECK(after.validity.concave_cells == reference.validity.concave_cells);
        CHECK(after.validity.min_scaled_jacobian ==
              Approx(reference.validity.min_scaled_jacobian).margin(1e-5).epsilon(0));
        CHECK(after.scaled_jacobian.mean == Approx(reference.scaled_jacobian.mean).margin(1e-5).epsilon(0));
    }
}

TEST_CASE("what does not move keeps its bits, and a mesh that cannot be bettered all of them") {
    const HexMesh input = tangled_mesh("grid-warped", 0.2, 5);
    HexMesh mesh = input;
    REQUIRE(improve(mesh, BoundaryMode::slide));
    const Topology topology = compute_topology(input);
    Context context(1);
    const auto model = build_boundary_model(input, topology, {}, context);
    REQUIRE(model);
    std::size_t corners = 0;
    for (Index v = 0; v < input.vertex_count(); ++v)
        if (model->associations()[v].kind == EntityKind::corner) {
            REQUIRE(mesh.positions[v] == input.positions[v]);
            ++corners;
        }
    CHECK(corners > 0);

    HexMesh perfect = tangled_mesh("grid", 0, 5);
    for (Point& p : perfect.positions) p = 0.3 * p + Point(0.1, 0.7, 1.3); // not on the grid of any pose
    const std::vector<Point> before = perfect.positions;
    const auto outcome = improve(perfect, BoundaryMode::slide);
    REQUIRE(outcome);
    CHECK(outcome->stats->min_sj_after >= outcome->stats->min_sj_before);
    for (Index v = 0; v < before.size(); ++v) REQUIRE(glm::distance(perfect.positions[v], before[v]) < 1e-6);
}

TEST_CASE("a mesh without cells is refused") {
    HexMesh mesh;
    const auto outcome = improve(mesh, BoundaryMode::fixed);
    REQUIRE_FALSE(outcome);
    CHECK(outcome.error().code == ErrorCode::bad_input);
}

TEST_CASE("vertices slide along a given line and do not leave it, as they would without") {
    // Columns of unequal width whose top is a roof of 11 degrees with its ridge at x = 4.
    constexpr int kSize = 5;
    const std::array<double, kSize + 1> width{0, 2, 4, 4.5, 5, 5.5};
    HexMesh mesh = tangled_mesh("grid", 0, kSize);
    std::vector<Index> ridge;
    const auto step = [&](double x) { return width[static_cast<std::size_t>(std::lround(x * kSize))]; };
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const Point unit = mesh.positions[v];
        const double x = step(unit.x), height = 5 - 0.1 * std::abs(x - 4);
        mesh.positions[v] = Point(x, step(unit.y), unit.z * height);
        if (x == 4 && unit.z == 1) ridge.push_back(v);
    }
    REQUIRE(ridge.size() == kSize + 1);
    const Index inside = (kSize + 1) * (kSize + 1) * 2 + (kSize + 1) * 2 + 2;
    std::swap(mesh.positions[inside], mesh.positions[inside + 1]); // something to mend
    const std::vector<Point> before = mesh.positions;
    const TriangleSoup surface = boundary_soup(mesh, compute_topology(mesh));
    const FeatureLines line{"ridge.csv",
                            {{Point(4, 0, 5), Point(4, 1, 5)}, {Point(4, 1, 5), Point(4, 5.5, 5)}}};
    for (const TriangleSoup* given : {static_cast<const TriangleSoup*>(nullptr), &surface})
        for (const bool with_line : {false, true}) {
            INFO(with_line << (given ? " surface" : ""));
            mesh.positions = before;
            ImproveOptions options;
            options.surface = given;
            if (with_line) options.feature_lines = {line};
            StageClock clock;
            Context context(1);
            const auto outcome = improve_mesh(mesh, options, clock, context);
            REQUIRE(outcome);
            CHECK(outcome->verdict == ErrorCode::ok);
            double off = 0, along = 0;
            for (Index v : ridge) {
                off = std::max(off, std::abs(mesh.positions[v].x - 4));
                along = std::max(along, std::abs(mesh.positions[v].y - before[v].y));
            }
            CHECK(along > 0.02);
            if (with_line)
                CHECK(off < 1e-12);
            else
                CHECK(off > 0.1);
        }
}

TEST_CASE("a line that the mesh does not follow is refused, or named where the surface is given") {
    HexMesh mesh = tangled_mesh("grid", 0, 4);
    const std::vector<Point> before = mesh.positions;
    const TriangleSoup surface = boundary_soup(mesh, compute_topology(mesh));
    ImproveOptions options;
    options.feature_lines = {{"cut.csv", {{Point(0, 0, 1), Point(1, 1, 1)}}}};
    StageClock clock;
    Context context(1);
    const auto refused = improve_mesh(mesh, options, clock, context);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::bad_input);
    CHECK_THAT(refused.error().one_line(), Catch::Contains("cut.csv near (0, 0, 1)"));
    CHECK(mesh.positions == before);
    options.surface = &surface;
    const auto named = improve_mesh(mesh, options, clock, context);
    REQUIRE(named);
    const auto& notes = named->notes;
    CHECK(std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
        return note.find("1 feature lines are followed by no edges of the mesh: cut.csv near") == 0;
    }));
}

TEST_CASE("features that go farther along the surface than the boundary may leave it are told") {
    for (const auto& [rel, far] : {std::pair(0.01, true), std::pair(0.03, false)}) {
        HexMesh mesh = tangled_mesh("octree-warped", 0.3, 3);
        ImproveOptions options;
        options.optimize.max_deviation_rel = rel;
        StageClock clock;
        Context context(1);
        const auto outcome = improve_mesh(mesh, options, clock, context);
        REQUIRE(outcome);
        REQUIRE(outcome->deviation);
        CHECK(outcome->deviation->largest_rel() < 1.03 * rel);
        CHECK((outcome->deviation->feature_largest() > rel * outcome->deviation->diagonal) == far);
        const auto& notes = outcome->notes;
        CHECK(std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
                  return note.find("Feature lines and corners moved") != std::string::npos;
              }) == far);
    }
}

TEST_CASE("faces of an improved mesh are flattened where asked for, and its worst cell stays") {
    // Two cells, one upon the other, whose common face is warped along the edges of their prism.
    HexMesh start;
    for (int z = 0; z < 3; ++z)
        for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)})
            start.positions.emplace_back(x, y, z);
    start.cells = {{0, 1, 2, 3, 4, 5, 6, 7}, {4, 5, 6, 7, 8, 9, 10, 11}};
    for (Index k = 0; k < 4; ++k) start.positions[4 + k].z = 1 + (k % 2 == 0 ? 0.55 : -0.55);
    double least = -1;
    for (const bool flatten : {false, true}) {
        HexMesh mesh = start;
        ImproveOptions options;
        options.flatten = flatten;
        options.optimize.time_limit_s = 1e-9; // ends as it began
        StageClock clock;
        Context context(1);
        const auto outcome = improve_mesh(mesh, options, clock, context);
        REQUIRE(outcome);
        REQUIRE(outcome->warped.has_value() == flatten);
        if (flatten) {
            CHECK(outcome->warped->warped_before == 1);
            CHECK(outcome->warped->warped_after == 0);
            CHECK(outcome->deviation->largest_rel() < 1e-9);
        }
        CHECK(outcome->after.validity.min_scaled_jacobian >= least);
        least = outcome->after.validity.min_scaled_jacobian;
    }
}
