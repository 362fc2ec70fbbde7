#include "mesh/canonical_form.hpp"
#include "mesh/random_remap.hpp"
#include "mesh/tight_box.hpp"
#include "mesh/validate_structure.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

using namespace hexopt;

namespace {

HexMesh sample(const char* name, double tangled) {
    SampleOptions options;
    options.size = 5;
    options.tangled = tangled;
    Context context(1, 3);
    Result<HexMesh> mesh = make_sample(name, options, context);
    REQUIRE(mesh);
    return std::move(*mesh);
}

CanonicalForm form_of(const HexMesh& mesh) {
    return compute_canonical_form(mesh, compute_topology(mesh), Parallel(2));
}

HexMesh changed(const HexMesh& mesh, std::uint64_t seed) {
    HexMesh result = apply_remap(mesh, test::random_remap(mesh, seed));
    test::turn_cells(result, seed);
    Random random(seed);
    const glm::dquat turn = glm::normalize(glm::dquat(random.uniform(-1, 1), random.uniform(-1, 1),
                                                      random.uniform(-1, 1), random.uniform(-1, 1)));
    const double factor = seed % 2 ? 1e6 : 1e-6;
    const Point shift(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    for (Point& p : result.positions) p = factor * (turn * p + shift);
    return result;
}

bool are_same(const HexMesh& a, const HexMesh& b) {
    return a.positions == b.positions && a.cells == b.cells && a.level == b.level &&
           a.hanging.vertex == b.hanging.vertex && a.hanging.master == b.hanging.master &&
           a.hanging.weight == b.hanging.weight;
}

} // namespace

TEST_CASE("place, unit and numbering leave the canonical form the same to the last bit") {
    const auto [name, tangled] =
        GENERATE(std::pair{"grid-warped", 0.3}, std::pair{"octree-warped", 0.2},
                 std::pair{"octree-corner", 0.0}, std::pair{"octree-ball", 0.1}, std::pair{"grid", 0.0});
    CAPTURE(name);
    const HexMesh mesh = sample(name, tangled);
    const CanonicalForm form = form_of(mesh);
    for (const std::uint64_t seed : {1, 2, 3, 4}) {
        CAPTURE(seed);
        CHECK(are_same(form_of(changed(mesh, seed)).mesh, form.mesh));
    }
}

TEST_CASE("a canonical form is the mesh: the remap and the pose lead there and back") {
    const HexMesh mesh = sample("octree-warped", 0.2);
    const CanonicalForm form = form_of(mesh);
    CHECK(require_structure(form.mesh, "test", Parallel(1)));
    CHECK(form.mesh.hanging.count() == mesh.hanging.count());
    const double width = form.pose.grid / form.pose.scale;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        const Point& there = form.mesh.positions[form.remap.vertex_old2new[v]];
        REQUIRE(glm::distance(there, form.pose.place(mesh.positions[v])) < 4 * form.pose.grid);
        const Point back = form.pose.centre + form.pose.way_back(there);
        REQUIRE(glm::distance(back, mesh.positions[v]) < 4 * width);
    }
    for (Index c = 0; c < mesh.cell_count(); ++c) {
        const Cell& there = form.mesh.cells[form.remap.cell_old2new[c]];
        REQUIRE(there[0] == *std::min_element(there.begin(), there.end()));
        REQUIRE(form.mesh.level[form.remap.cell_old2new[c]] == mesh.level[c]);
        const auto volume = [](const HexMesh& m, const Cell& cell) {
            const auto edge = [&](int k) { return m.positions[cell[k]] - m.positions[cell[0]]; };
            return glm::dot(glm::cross(edge(1), edge(3)), edge(4));
        };
        Cell given = mesh.cells[c];
        for (Index& v : given) v = form.remap.vertex_old2new[v];
        // One of the 24 numberings that keep the orientation has this corner first, and so this volume.
        const auto first = std::find(given.begin(), given.end(), there[0]) - given.begin();
        constexpr int kNext[8][3] = {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7},
                                     {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}};
        const Cell turned = {given[first], given[kNext[first][0]], 0, given[kNext[first][1]],
                             given[kNext[first][2]]};
        REQUIRE(volume(form.mesh, there) == Approx(volume(form.mesh, turned)).margin(1e-12));
    }
}

TEST_CASE("a mesh without cells has a canonical form too") {
    CHECK(form_of(HexMesh{}).mesh.cell_count() == 0);
    HexMesh unused;
    unused.positions = {Point(1, 2, 3), Point(4, 5, 6)};
    const CanonicalForm form = form_of(unused);
    REQUIRE(form.mesh.vertex_count() == 2);
    for (const Point& p : form.mesh.positions) CHECK(std::isfinite(p.x + p.y + p.z));
}

TEST_CASE("a box that was turned is found again") {
    std::vector<Point> points;
    const glm::dquat turn = glm::normalize(glm::dquat(0.3, -0.5, 0.7, 0.2));
    for (int k = 0; k < 8; ++k) points.push_back(turn * Point(k & 1 ? 3 : 0, k & 2 ? 2 : 0, k & 4 ? 1 : 0));
    const glm::dmat3 axes = find_tight_box(points);
    Point low(HUGE_VAL), high(-HUGE_VAL);
    for (const Point& p : points) {
        const Point q = axes * p;
        low = glm::min(low, q), high = glm::max(high, q);
    }
    CHECK(glm::length(high - low) < 1.001 * std::sqrt(14.0));
}
