#include "stages/refine/refine.hpp"
#include "stages/refine/surface_elements.hpp"

#include "core/random.hpp"
#include "domain/closest_point.hpp"
#include "mesh/topology.hpp"
#include "mesh/validate_structure.hpp"
#include "surfaces.hpp"

#include <glm/vector_relational.hpp>

using namespace hexopt;
using namespace hexopt::test;

namespace {

RefineOutput run(const Domain& domain, const RefineOptions& options, int threads = 2) {
    Context context(threads);
    auto out = refine(domain, options, context);
    if (!out) FAIL(out.error().one_line());
    return std::move(out).value();
}

TriangleSoup make_box(const Point& size) {
    TriangleSoup soup;
    append_box(soup, Point(0), size);
    return soup;
}

bool cuts(const Domain& domain, const Box& box) {
    for (Index t = 0; t < domain.model.triangle_count(); ++t)
        if (triangle_meets_box(domain.model.triangle(t), box)) return true;
    return false;
}

std::array<double, 2> size_range(const HexMesh& mesh, Index cell) {
    double shortest = 1e300, longest = 0;
    for (const auto& edge : hex::kEdgeVertex) {
        const double length = glm::distance(mesh.positions[mesh.cells[cell][edge[0]]],
                                            mesh.positions[mesh.cells[cell][edge[1]]]);
        shortest = std::min(shortest, length);
        longest = std::max(longest, length);
    }
    return {shortest, longest};
}

void require_sound(const HexMesh& mesh) {
    for (const Violation& violation : validate_structure(mesh, Parallel(2))) FAIL(violation.one_line());
}

} // namespace

TEST_CASE("a triangle and a box meet where their distance is zero") {
    Random random(3);
    int met = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        std::array<Point, 3> triangle;
        const double reach = trial % 2 ? 3 : 1.2;
        for (Point& p : triangle)
            p = {random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach)};
        const Point half(random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.1, 1));
        const Box box{-half, half};
        // Alternating projections between the two convex sets.
        Point on_box(0);
        double distance = 0;
        for (int k = 0; k < 300; ++k) {
            const Point on_triangle =
                closest_on_triangle(on_box, triangle[0], triangle[1], triangle[2]).point;
            on_box = glm::clamp(on_triangle, box.low, box.high);
            distance = glm::distance(on_box, on_triangle);
        }
        const bool meets = triangle_meets_box(triangle, box);
        met += meets;
        if (distance < 1e-12) REQUIRE(meets);
        const ClippedTriangle part = clip_triangle(triangle, box);
        if (part.count > 0) REQUIRE(meets);
        if (meets && part.count == 0) REQUIRE(distance < 1e-3);
        for (int k = 0; k < part.count; ++k) {
            const auto& w = part.weight[k];
            const Point x = w[0] * triangle[0] + w[1] * triangle[1] + w[2] * triangle[2];
            REQUIRE(glm::all(glm::lessThanEqual(glm::abs(x), half + Point(1e-12))));
        }
    }
    REQUIRE(met > 2000);
    REQUIRE(met < 18000);
}

TEST_CASE("cells on the surface have its size, those inside are larger") {
    const Domain domain = make_domain(make_box({3, 3, 3}));
    RefineOptions options;
    options.surface.size = 0.11;
    const RefineOutput out = run(domain, options);
    require_sound(out.octree);
    REQUIRE(out.octree.cell_count() == out.leaf_node.size());
    std::size_t on_surface = 0, coarse = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        const auto [shortest, longest] = size_range(out.octree, c);
        const Box box = node_box(out.refinement, out.leaf_node[c]);
        coarse += longest > 0.3;
        if (!cuts(domain, box)) continue;
        ++on_surface;
        REQUIRE(longest <= 0.11 * (1 + 1e-6));
        REQUIRE(shortest > 0.11 / 1.2);
    }
    REQUIRE(on_surface > 1000);
    REQUIRE(coarse > 0);
    // No grid plane lies on the surface: its extreme planes are a good part of a cell away.
    for (const Point& p : out.octree.positions)
        for (int d = 0; d < 3; ++d) {
            REQUIRE(std::abs(p[d]) > 0.1 * 0.09);
            REQUIRE(std::abs(p[d] - 3) > 0.1 * 0.09);
        }
}

TEST_CASE("neighbours of cells on the surface are no larger than these") {
    const Domain domain = make_domain(make_sphere(1, 24));
    RefineOptions options;
    options.surface.size = 0.1;
    options.normal_angle_deg = 180;
    const RefineOutput out = run(domain, options);
    const Csr<CellCorner> cells = compute_vertex_cell(out.octree);
    std::size_t checked = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        if (!cuts(domain, node_box(out.refinement, out.leaf_node[c]))) continue;
        for (Index v : out.octree.cells[c])
            for (CellCorner other : cells[v]) {
                REQUIRE(out.octree.level[other.cell] >= out.octree.level[c]);
                ++checked;
            }
    }
    REQUIRE(checked > 1000);
    REQUIRE(out.stats.layers > 0);
}

TEST_CASE("cells turn by no more than the angle of normals where levels allow") {
    // Radius 1 and 0.2: at size 0.25 only the small one turns by more than 30 degrees in a cell.
    TriangleSoup soup = make_sphere(1, 60);
    const TriangleSoup small = make_sphere(0.2, 60, {2, 0, 0});
    const Index first = static_cast<Index>(soup.vertices.size());
    soup.vertices.insert(soup.vertices.end(), small.vertices.begin(), small.vertices.end());
    for (auto t : small.triangles) soup.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    soup.patch.assign(soup.triangles.size(), 0);
    const Domain domain = make_domain(soup);
    RefineOptions options;
    options.surface.size = 0.25;
    options.surface_rings = 0;
    const RefineOutput out = run(domain, options);
    require_sound(out.octree);
    REQUIRE(out.stats.split[static_cast<std::size_t>(RefineCriterion::normal_angle)] > 0);
    double finest_large = 1, finest_small = 1, coarsest_small = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        const Box box = node_box(out.refinement, out.leaf_node[c]);
        if (!cuts(domain, box)) continue;
        const double size = size_range(out.octree, c)[1];
        if (box.high.x < 0.5) finest_large = std::min(finest_large, size);
        if (box.low.x > 1.6)
            finest_small = std::min(finest_small, size), coarsest_small = std::max(coarsest_small, size);
    }
    REQUIRE(finest_large > 0.2);
    REQUIRE(finest_small < 0.07);
    REQUIRE(coarsest_small < 0.13);
}

TEST_CASE("a patch may ask for another size") {
    const Domain domain = make_domain(make_box({1, 1, 1}));
    RefineOptions options;
    options.surface.level = 2;
    options.patches = {{"x1", {0, 4}}};
    const RefineOutput out = run(domain, options);
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        const Box box = node_box(out.refinement, out.leaf_node[c]);
        if (box.low.x < 1 && box.high.x > 1 && box.low.y > 0 && box.high.y < 1 && box.low.z > 0 &&
            box.high.z < 1)
            REQUIRE(out.octree.level[c] == 4);
        if (box.low.x < 0 && box.high.x > 0 && cuts(domain, box)) REQUIRE(out.octree.level[c] == 2);
    }
    options.patches = {{"wing", {0, 4}}};
    Context context(1);
    const auto refused = refine(domain, options, context);
    REQUIRE_FALSE(refused.has_value());
    REQUIRE(refused.error().code == ErrorCode::usage);
}

TEST_CASE("the budget of cells is kept and reported") {
    const Domain domain = make_domain(make_sphere(1, 40));
    RefineOptions options;
    options.surface.size = 0.05;
    const std::size_t all = run(domain, options).octree.cell_count();
    options.max_cells = all / 3;
    const RefineOutput out = run(domain, options);
    REQUIRE(out.octree.cell_count() <= all / 3);
    REQUIRE(out.stats.budget_refused > 0);
    require_sound(out.octree);
}

TEST_CASE("any number of threads gives the same mesh") {
    const Domain domain = make_domain(make_sphere(1, 50));
    RefineOptions options;
    options.surface.size = 0.15;
    options.normal_angle_deg = 10;
    const RefineOutput one = run(domain, options, 1), three = run(domain, options, 3);
    REQUIRE(one.octree.cells == three.octree.cells);
    REQUIRE(one.octree.positions == three.octree.positions);
    REQUIRE(one.octree.hanging.master == three.octree.hanging.master);
}

TEST_CASE("named cells are refined later") {
    const Domain domain = make_domain(make_sphere(1, 20));
    RefineOptions options;
    options.surface.size = 0.2;
    RefineOutput out = run(domain, options);
    const std::size_t before = out.octree.cell_count();
    const Index cell = static_cast<Index>(before / 2), node = out.leaf_node[cell];
    Context context(2);
    const std::uint64_t revision = out.octree.revision;
    const RefineCount count = refine_cells(out, std::vector<Index>{cell}, context);
    REQUIRE(count.requested == 1);
    REQUIRE(out.octree.cell_count() == before + 7 * (1 + count.balance));
    REQUIRE(out.octree.revision > revision);
    REQUIRE_FALSE(out.refinement.node(node).is_leaf());
    require_sound(out.octree);
}

TEST_CASE("any mesh of hexahedra can be the initial mesh") {
    const Domain domain = make_domain(make_sphere(1, 30));
    RefineOptions options;
    // A shell between a small cube and a large one would not contain the sphere's inside; a bent box does.
    HexMesh box;
    for (int v = 0; v < 8; ++v)
        box.positions.push_back(
            2.0 * (2.0 * Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]) - Point(1)));
    box.positions[6] += Point(1, 0.7, 0.4);
    box.positions[1] += Point(0.3, -0.8, -0.5);
    box.cells = {{0, 1, 2, 3, 4, 5, 6, 7}};
    options.initial.mesh = box;
    options.surface.level = 5;
    const RefineOutput out = run(domain, options);
    require_sound(out.octree);
    // Whatever holds a point of the surface is fine: the bounding boxes only add to that.
    std::size_t deep = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        double near = 1e9, far = 0;
        for (Index v : out.octree.cells[c]) {
            near = std::min(near, glm::length(out.octree.positions[v]));
            far = std::max(far, glm::length(out.octree.positions[v]));
        }
        if (near < 0.99 && far > 1) REQUIRE(out.octree.level[c] >= 5);
        deep += out.octree.level[c] == 5;
    }
    REQUIRE(deep > 500);
}

TEST_CASE("options out of range are refused") {
    const Domain domain = make_domain(make_box({1, 1, 1}));
    Context context(1);
    const auto refused = [&](auto change) {
        RefineOptions options;
        change(options);
        const auto out = refine(domain, options, context);
        REQUIRE_FALSE(out.has_value());
        REQUIRE(out.error().code == ErrorCode::usage);
    };
    refused([](RefineOptions& o) { o.rings = 0; });
    refused([](RefineOptions& o) { o.surface_rings = -1; });
    refused([](RefineOptions& o) { o.surface_layers = -1; });
    refused([](RefineOptions& o) { o.normal_angle_deg = 181; });
    refused([](RefineOptions& o) { o.target_cells = 0; });
    refused([](RefineOptions& o) { o.surface.size = -1; });
    refused([](RefineOptions& o) { o.initial.base_size = std::nan(""); });
    refused([](RefineOptions& o) { o.initial.cells = {1, 0, 2}; });
    refused([](RefineOptions& o) { o.initial.box = Box{Point(0), Point(1, 0, 1)}; });
    context.cancel();
    REQUIRE(refine(domain, {}, context).error().code == ErrorCode::cancelled);
}
