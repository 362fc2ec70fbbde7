#include "mesh/hanging.hpp"
#include "mesh/mesh_oracles.hpp"

using namespace hexopt;
using namespace hexopt::test;

TEST_CASE("every sample is valid, closed and the same each time") {
    for (const std::string& name : sample_names()) {
        CAPTURE(name);
        const SampleOptions options{.size = name == "large" ? 20u : 0u};
        const HexMesh mesh = sample(name, options), again = sample(name, options);
        CHECK(mesh.cells == again.cells);
        CHECK(mesh.positions == again.positions);
        CHECK(mesh.level.size() == mesh.cell_count());
        CHECK(max_hanging_deviation(mesh.hanging, mesh.positions) == 0);
        const std::size_t tangled = count_tangled(mesh, Parallel(2));
        if (name == "scrambled-cube")
            CHECK(tangled > mesh.cell_count() * 9 / 10);
        else
            CHECK(tangled == 0);
        std::vector<std::uint8_t> used(mesh.vertex_count(), 0);
        for (const Cell& cell : mesh.cells)
            for (Index v : cell) used.at(v) = 1;
        CHECK(std::count(used.begin(), used.end(), 0) == 0);
    }
}

TEST_CASE("samples fill the volume that their geometry says") {
    CHECK(volume_of_cells(sample("grid")) == Approx(1));
    CHECK(volume_of_cells(sample("grid-graded")) == Approx(0.4));
    CHECK(volume_of_cells(sample("scrambled-cube", {.size = 6})) == Approx(1));
    CHECK(volume_of_cells(sample("octree-corner")) == Approx(1));
    CHECK(volume_of_cells(sample("octree-sphere", {.tangled = 0.4})) == Approx(1));
    const double ball = 4 / 3.0 * 3.14159265 * 0.47 * 0.47 * 0.47;
    const double trimmed = volume_of_cells(sample("octree-trimmed", {.levels = 3}));
    CHECK(trimmed < ball);
    CHECK(trimmed > 0.85 * ball);
}

TEST_CASE("octrees are balanced: neighbours through any vertex differ by one level at most") {
    for (const std::string& name : kOctrees)
        for (int levels : {2, 3, 4}) {
            CAPTURE(name, levels);
            const HexMesh mesh = sample(name, {.size = name == "octree-trimmed" ? 6u : 3u, .levels = levels});
            std::vector<std::uint8_t> lowest(mesh.vertex_count(), 255), highest(mesh.vertex_count(), 0);
            for (std::size_t c = 0; c < mesh.cell_count(); ++c)
                for (Index v : mesh.cells[c]) {
                    lowest[v] = std::min(lowest[v], mesh.level[c]);
                    highest[v] = std::max(highest[v], mesh.level[c]);
                }
            for (std::size_t v = 0; v < mesh.vertex_count(); ++v) REQUIRE(highest[v] - lowest[v] <= 1);
            CHECK(*std::max_element(mesh.level.begin(), mesh.level.end()) == levels);
            CHECK(*std::min_element(mesh.level.begin(), mesh.level.end()) < levels);
        }
}

TEST_CASE("isotropic octrees have no chains, halved ones have") {
    const auto most_masters = [](const HexMesh& mesh) {
        std::size_t most = 0;
        for (std::size_t row = 0; row < mesh.hanging.count(); ++row)
            most = std::max(most, mesh.hanging.offset[row + 1] - mesh.hanging.offset[row]);
        return most;
    };
    for (const char* name : {"octree-corner", "octree-sphere"}) {
        const HexMesh mesh = sample(name);
        CHECK(most_masters(mesh) == 4);
        CHECK(std::all_of(mesh.hanging.weight.begin(), mesh.hanging.weight.end(),
                          [](double w) { return w == 0.5 || w == 0.25; }));
    }
    CHECK(most_masters(sample("octree-halved")) > 4);
}

TEST_CASE("perturb reaches the wanted fraction and leaves boundary and constraints alone") {
    for (const char* name : {"grid-warped", "octree-sphere", "octree-halved"})
        for (double fraction : {0.01, 0.1, 0.6})
            for (PerturbPattern pattern : {PerturbPattern::everywhere, PerturbPattern::spots}) {
                CAPTURE(name, fraction, int(pattern));
                const HexMesh start = sample(name);
                const HexMesh mesh = sample(name, {.tangled = fraction, .pattern = pattern}, 5);
                const double cells = static_cast<double>(mesh.cell_count());
                const double reached = static_cast<double>(count_tangled(mesh, Parallel(2))) / cells;
                CHECK(reached == Approx(fraction).epsilon(0.1).margin(2 / cells));
                CHECK(max_hanging_deviation(mesh.hanging, mesh.positions) == 0);
                const Topology topology = compute_topology(mesh);
                for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
                    if (topology.on_boundary[v]) REQUIRE(mesh.positions[v] == start.positions[v]);
            }
}

TEST_CASE("samples reject what they cannot make") {
    Context context;
    const auto error = [&](std::string_view name, const SampleOptions& options) {
        const auto mesh = make_sample(name, options, context);
        REQUIRE_FALSE(mesh);
        return mesh.error().one_line();
    };
    using Catch::Matchers::Contains;
    CHECK_THAT(error("no-such", {}), Contains("octree-halved"));
    CHECK_THAT(error("grid", {.levels = 2}), Contains("levels"));
    CHECK_THAT(error("octree-ball", {.levels = 9}), Contains("0..6"));
    CHECK_THAT(error("grid", {.size = 1, .tangled = 0.5}), Contains("cannot be tangled"));
    CHECK_THAT(error("grid", {.tangled = 2}), Contains("0..0.9"));
    context.cancel();
    const auto cancelled = make_sample("grid", {}, context);
    REQUIRE_FALSE(cancelled);
    CHECK(cancelled.error().code == ErrorCode::cancelled);
}
