#include "mesh/validate_structure.hpp"

#include "core/random.hpp"
#include "mesh/colouring.hpp"
#include "mesh/recognise_hanging.hpp"
#include "mesh_oracles.hpp"

#include <limits>

using namespace hexopt;
using namespace hexopt::test;

namespace {

std::vector<Violation> check(const HexMesh& mesh) { return validate_structure(mesh, Parallel(2)); }

/// The only violation of a mesh.
Violation only(const HexMesh& mesh) {
    const auto found = check(mesh);
    for (const Violation& violation : found) UNSCOPED_INFO(violation.one_line());
    REQUIRE(found.size() == 1);
    return found.front();
}

const HexMesh& cube() {
    static const HexMesh mesh = sample("grid", {.size = 3});
    return mesh;
}

const HexMesh& octree() {
    static const HexMesh mesh = sample("octree-halved", {.size = 4});
    return mesh;
}

} // namespace

TEST_CASE("samples are structurally valid") {
    for (const std::string& name : sample_names()) {
        CAPTURE(name);
        const HexMesh mesh = sample(name, {.size = name == "large" ? 20u : 0u});
        CHECK(check(mesh).empty());
        CHECK(require_structure(mesh, "test", Parallel(1)));
    }
    CHECK(check(HexMesh{}).empty());
}

TEST_CASE("validate_structure finds ids out of range and repeated vertices") {
    HexMesh mesh = cube();
    mesh.cells[4][3] = 1000;
    mesh.cells[9][0] = kNoIndex;
    const Violation range = only(mesh);
    CHECK(range.kind == ViolationKind::vertex_out_of_range);
    CHECK(range.count == 2);
    CHECK(range.places == std::vector<std::string>{"cell 4: vertex 1000", "cell 9: vertex 4294967295"});

    mesh = cube();
    mesh.cells[7][2] = mesh.cells[7][1];
    const auto found = check(mesh);
    REQUIRE_FALSE(found.empty());
    CHECK(found.front().kind == ViolationKind::repeated_vertex);
    CHECK(found.front().count == 1);
}

TEST_CASE("validate_structure finds positions that are not finite, where a cell uses them") {
    HexMesh mesh = cube();
    mesh.positions[5].y = std::numeric_limits<double>::quiet_NaN();
    mesh.positions[6].z = std::numeric_limits<double>::infinity();
    CHECK(only(mesh).places == std::vector<std::string>{"vertex 5", "vertex 6"});
    mesh = cube();
    mesh.positions.push_back(Point(std::numeric_limits<double>::quiet_NaN()));
    const Violation unused = only(mesh);
    CHECK(unused.kind == ViolationKind::unused_vertex);
    CHECK(unused.is_notice);
    CHECK(require_structure(mesh, "test", Parallel(1)));
}

TEST_CASE("validate_structure finds duplicates, overused and badly oriented faces") {
    HexMesh mesh = cube();
    mesh.level.clear();
    mesh.cells.push_back(mesh.cells[13]);
    auto found = check(mesh);
    REQUIRE(found.size() == 2);
    CHECK(found[0].kind == ViolationKind::duplicate_cell);
    CHECK(found[0].places.front() == "cell 27: same as cell 13");
    CHECK(found[1].kind == ViolationKind::face_overused);
    CHECK(found[1].count == 6);

    mesh = cube();
    Cell& turned = mesh.cells[13]; // the middle one
    for (int k = 0; k < 4; ++k) std::swap(turned[k], turned[k + 4]);
    const Violation inconsistent = only(mesh);
    CHECK(inconsistent.kind == ViolationKind::face_inconsistent);
    CHECK(inconsistent.count == 6);

    mesh = cube();
    std::swap(mesh.cells[0][1], mesh.cells[0][2]); // its +x face keeps its vertices in another order
    found = check(mesh);
    REQUIRE_FALSE(found.empty());
    for (const Violation& violation : found)
        CHECK((violation.kind == ViolationKind::face_twisted ||
               violation.kind == ViolationKind::face_overused));
}

TEST_CASE("validate_structure finds broken constraints") {
    const auto kind_of = [](const HexMesh& mesh) { return only(mesh).kind; };
    HexMesh mesh = octree();
    mesh.hanging.weight[3] += 0.01;
    CHECK(kind_of(mesh) == ViolationKind::hanging_weights);
    mesh = octree();
    mesh.hanging.weight[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(kind_of(mesh) == ViolationKind::hanging_weights);
    mesh = octree();
    std::swap(mesh.hanging.master[0], mesh.hanging.master[1]);
    CHECK(kind_of(mesh) == ViolationKind::hanging_shape);
    mesh = octree();
    mesh.hanging.offset.pop_back();
    CHECK(kind_of(mesh) == ViolationKind::hanging_shape);
    mesh = octree();
    mesh.hanging.offset.clear();
    CHECK(kind_of(mesh) == ViolationKind::hanging_shape);
    mesh = octree();
    mesh.hanging.master[1] = static_cast<Index>(mesh.vertex_count());
    CHECK(kind_of(mesh) == ViolationKind::hanging_out_of_range);
    mesh = octree();
    const std::size_t last = mesh.hanging.count() - 1;
    mesh.hanging.vertex[last] = kNoIndex;
    CHECK(kind_of(mesh) == ViolationKind::hanging_out_of_range);
    mesh = octree();
    mesh.hanging.master[mesh.hanging.offset[1] - 1] = mesh.hanging.vertex[last];
    CHECK(check(mesh).back().kind == ViolationKind::hanging_open);
}

TEST_CASE("validate_structure finds wrong levels and boundary quads, and an error names all") {
    HexMesh mesh = cube();
    mesh.level.pop_back();
    CHECK(only(mesh).kind == ViolationKind::level_count);
    mesh.patch_names = {"wall"};
    mesh.boundary = {{{0, 1, 5, 4}, 0}, {{0, 1, 5, 4}, 1}, {{0, 1, 2, 99}, 0}};
    const auto found = check(mesh);
    REQUIRE(found.size() == 2);
    CHECK(found[1].kind == ViolationKind::boundary_out_of_range);
    CHECK(found[1].count == 2);
    const Status status = require_structure(mesh, "optimize", Parallel(1));
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::bad_input);
    CHECK_THAT(status.error().one_line(),
               Catch::Matchers::Contains("level_count: 1 (26 levels for 27 cells)") &&
                   Catch::Matchers::Contains("boundary_out_of_range: 2"));
    mesh = cube();
    mesh.patch_names = {"wall"};
    mesh.boundary = {{{0, 1, 5, 4}, 0}, {{21, 22, 26, 25}, 0}, {{0, 1, 2, 3}, 0}};
    const Violation odd = only(mesh);
    CHECK(odd.kind == ViolationKind::boundary_not_a_face);
    CHECK(odd.count == 2);
    CHECK(odd.is_notice);
}

TEST_CASE("validate_structure survives random damage, and what it passes can be used") {
    std::size_t sound = 0;
    for (std::uint64_t seed = 0; seed < 400; ++seed) {
        Random random(seed);
        HexMesh mesh = random.below(2) ? sample("octree-halved", {.size = 2}) : sample("grid", {.size = 2});
        const auto any = [&](auto& list) -> auto& { return list[random.below(list.size())]; };
        const auto any_id = [&] {
            return static_cast<Index>(random.below(4) ? random.below(mesh.vertex_count()) : random.next());
        };
        for (std::uint64_t damage = random.below(4); damage-- > 0;) switch (random.below(8)) {
            case 0:
                any(mesh.cells)[random.below(8)] = any_id();
                break;
            case 1:
                mesh.cells.push_back(any(mesh.cells));
                break;
            case 2:
                mesh.positions.pop_back();
                break;
            case 3:
                mesh.hanging.offset.push_back(random.below(100));
                break;
            case 4:
                mesh.boundary.push_back({{any_id(), any_id(), any_id(), any_id()}, any_id()});
                break;
            case 5:
                if (!mesh.hanging.empty()) any(mesh.hanging.master) = any_id();
                break;
            case 6:
                if (!mesh.hanging.empty()) any(mesh.hanging.vertex) = any_id();
                break;
            case 7:
                any(mesh.positions).x = std::numeric_limits<double>::infinity();
                break;
            }
        if (!require_structure(mesh, "test", Parallel(1))) continue;
        ++sound;
        const Topology topology = compute_topology(mesh);
        CHECK(compute_colouring(mesh, topology, compute_stencils(mesh, topology)).count() >= 8);
        CHECK(recognise_hanging(mesh, {}, Parallel(1)));
    }
    CHECK(sound > 50);
    CHECK(sound < 350);
}
