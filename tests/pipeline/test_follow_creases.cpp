#include "pipeline/follow_creases.hpp"

#include "mesh/hanging.hpp"
#include "mesh/refine_cells.hpp"
#include "quality/mesh_quality.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kRidge = 2.2, kRise = 0.4; ///< of a roof of about 21 degrees on a box of 4 x 2 x 1

double roof(double x) { return 1 + (x < kRidge ? kRise * x / kRidge : kRise * (4 - x) / (4 - kRidge)); }

TriangleSoup make_roof() {
    TriangleSoup soup;
    soup.patch_names = {"all"};
    const auto polygon = [&](std::initializer_list<Point> x) {
        const auto first = static_cast<Index>(soup.vertices.size());
        soup.vertices.insert(soup.vertices.end(), x);
        for (Index k = 2; k < x.size(); ++k) {
            soup.triangles.push_back({first, first + k - 1, first + k});
            soup.patch.push_back(0);
        }
    };
    const double top = 1 + kRise;
    polygon({{0, 0, 0}, {0, 2, 0}, {4, 2, 0}, {4, 0, 0}});
    polygon({{0, 0, 0}, {0, 0, 1}, {0, 2, 1}, {0, 2, 0}});
    polygon({{4, 0, 0}, {4, 2, 0}, {4, 2, 1}, {4, 0, 1}});
    polygon({{kRidge, 0, top}, {0, 0, 1}, {0, 0, 0}, {4, 0, 0}, {4, 0, 1}});
    polygon({{kRidge, 2, top}, {4, 2, 1}, {4, 2, 0}, {0, 2, 0}, {0, 2, 1}});
    polygon({{0, 0, 1}, {kRidge, 0, top}, {kRidge, 2, top}, {0, 2, 1}});
    polygon({{kRidge, 0, top}, {4, 0, 1}, {4, 2, 1}, {kRidge, 2, top}});
    return soup;
}

/// 8 x 4 x 2 cells under the roof; their planes do not meet its ridge.
HexMesh make_mesh() {
    HexMesh mesh;
    constexpr Index kX = 8, kY = 4, kZ = 2;
    const auto number = [](Index i, Index j, Index k) { return (k * (kY + 1) + j) * (kX + 1) + i; };
    for (Index k = 0; k <= kZ; ++k)
        for (Index j = 0; j <= kY; ++j)
            for (Index i = 0; i <= kX; ++i)
                mesh.positions.emplace_back(0.5 * i, 0.5 * j, 0.5 * k * roof(0.5 * i));
    for (Index k = 0; k < kZ; ++k)
        for (Index j = 0; j < kY; ++j)
            for (Index i = 0; i < kX; ++i)
                mesh.cells.push_back({number(i, j, k), number(i + 1, j, k), number(i + 1, j + 1, k),
                                      number(i, j + 1, k), number(i, j, k + 1), number(i + 1, j, k + 1),
                                      number(i + 1, j + 1, k + 1), number(i, j + 1, k + 1)});
    return mesh;
}

/// The same with the cells along y = 0 halved: vertices hang at y = 0.5.
HexMesh make_two_sizes() {
    auto refinement = CellRefinement::create(make_mesh(), Parallel(1));
    REQUIRE(refinement);
    std::vector<RefineRequest> requests;
    for (Index node : refinement->leaves()) {
        double nearest = 1;
        for (Index v : refinement->node(node).vertices)
            nearest = std::min(nearest, refinement->position(v).y);
        if (nearest < 0.25) requests.push_back({node});
    }
    refinement->refine(requests);
    HexMesh mesh = refinement->leaf_mesh(Parallel(1)).mesh;
    for (Point& x : mesh.positions)
        if (x.z > 0.9 * roof(x.x)) x.z = roof(x.x);
    apply_hanging(mesh, Parallel(1));
    return mesh;
}

struct Roofed {
    HexMesh mesh;
    Topology topology = compute_topology(mesh);
    Context context{1};
    BoundaryModel model;

    explicit Roofed(HexMesh given = make_mesh()) : mesh(std::move(given)) {
        BoundaryOptions options;
        options.feature_angle_deg = 30;
        auto built = build_boundary_model(mesh, topology, make_roof(), options, context);
        REQUIRE(built);
        model = std::move(*built);
    }
};

} // namespace

TEST_CASE("quads and edges that cut across a crease end on it") {
    Roofed roofed;
    const std::vector<Point> before = roofed.mesh.positions;
    const auto report = follow_creases(roofed.mesh, roofed.topology, roofed.model, {}, roofed.context);
    REQUIRE(report);
    CHECK(report->far_before == 4);
    CHECK(report->far_after == 0);
    CHECK(report->largest_before_rel > 0.005);
    CHECK(report->largest_after_rel < 1e-9);
    CHECK(report->moved >= 5);
    std::size_t on_ridge = 0;
    for (Index v = 0; v < before.size(); ++v) {
        const Point& x = roofed.mesh.positions[v];
        on_ridge += std::abs(x.x - kRidge) < 1e-12 && std::abs(x.z - roof(kRidge)) < 1e-12;
        if (x == before[v]) continue;
        CHECK(std::abs(before[v].x - kRidge) < 0.5);
        CHECK(x.z == Approx(roof(x.x)));
    }
    CHECK(on_ridge == 5);
    const auto quality = compute_quality(roofed.mesh, roofed.topology, {}, roofed.context);
    REQUIRE(quality);
    CHECK(quality->validity.is_valid());
}

TEST_CASE("no cell becomes worse than it was and than it may") {
    Roofed roofed;
    std::vector<double> before;
    for (Index c = 0; c < roofed.mesh.cell_count(); ++c)
        before.push_back(compute_cell_validity(cell_points(roofed.mesh, c)).scaled_jacobian);
    FollowOptions options;
    options.min_sj = 1;
    REQUIRE(follow_creases(roofed.mesh, roofed.topology, roofed.model, options, roofed.context));
    for (Index c = 0; c < roofed.mesh.cell_count(); ++c)
        CHECK(compute_cell_validity(cell_points(roofed.mesh, c)).scaled_jacobian >= before[c] - 1e-15);
}

TEST_CASE("hanging vertices follow those that they hang on") {
    Roofed roofed(make_two_sizes());
    REQUIRE(roofed.mesh.hanging.count() > 10);
    const std::vector<Point> before = roofed.mesh.positions;
    const auto report = follow_creases(roofed.mesh, roofed.topology, roofed.model, {}, roofed.context);
    REQUIRE(report);
    CHECK(report->largest_before_rel > 0.005);
    CHECK(report->largest_after_rel < 0.1 * report->largest_before_rel);
    std::vector<Point> hung = roofed.mesh.positions;
    apply_hanging(roofed.mesh.hanging, hung, Parallel(1));
    double largest = 0;
    std::size_t moved = 0;
    for (Index v : roofed.mesh.hanging.vertex) {
        largest = std::max(largest, glm::distance(hung[v], roofed.mesh.positions[v]));
        moved += roofed.mesh.positions[v] != before[v];
    }
    CHECK(largest < 1e-15);
    CHECK(moved > 0);
    const auto quality = compute_quality(roofed.mesh, roofed.topology, {}, roofed.context);
    REQUIRE(quality);
    CHECK(quality->validity.is_valid());
}

TEST_CASE("what is reported after moving is what another run measures before") {
    for (const bool hangs : {false, true}) {
        Roofed roofed(hangs ? make_two_sizes() : make_mesh());
        FollowOptions options;
        options.distance_rel = options.search_rel = 1e-3;
        const auto first =
            follow_creases(roofed.mesh, roofed.topology, roofed.model, options, roofed.context);
        REQUIRE(first);
        CHECK(first->moved > 0);
        const auto again =
            follow_creases(roofed.mesh, roofed.topology, roofed.model, options, roofed.context);
        REQUIRE(again);
        CHECK(again->far_before == first->far_after);
        CHECK(again->largest_before_rel == Approx(first->largest_after_rel).margin(1e-14));
    }
}

TEST_CASE("a search brings the farthest quads nearer where creases give no place to go") {
    const auto follow = [](double search_rel, double share) {
        Roofed roofed;
        FollowOptions options;
        options.distance_rel = options.edge_rel = 0.1; // creases are left alone
        options.search_rel = search_rel;
        options.search_share = share;
        const auto report =
            follow_creases(roofed.mesh, roofed.topology, roofed.model, options, roofed.context);
        REQUIRE(report);
        const auto quality = compute_quality(roofed.mesh, roofed.topology, {}, roofed.context);
        REQUIRE(quality);
        CHECK(quality->validity.is_valid());
        return *report;
    };
    const FollowReport all = follow(1e-3, 1), few = follow(1e-3, 0.02), none = follow(1e-3, 0);
    CHECK(all.largest_after_rel < 0.5 * all.largest_before_rel);
    CHECK(all.moved > 0);
    CHECK(few.moved <= 1); // of 64 cells
    CHECK(none.moved == 0);
    CHECK(none.largest_after_rel == none.largest_before_rel);
}

TEST_CASE("vertices off the surface stay, and near quads are left alone") {
    Roofed roofed;
    FollowOptions options;
    options.distance_rel = options.edge_rel = options.search_rel = 0.1;
    const auto near = follow_creases(roofed.mesh, roofed.topology, roofed.model, options, roofed.context);
    REQUIRE(near);
    CHECK(near->moved == 0);
    for (Point& x : roofed.mesh.positions)
        if (x.z > 0.9 * roof(x.x)) x.z -= 0.01;
    const auto off = follow_creases(roofed.mesh, roofed.topology, roofed.model, {}, roofed.context);
    REQUIRE(off);
    CHECK(off->moved == 0);
}

} // namespace hexopt
