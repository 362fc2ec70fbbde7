#include "stages/refine/refine.hpp"
#include "stages/refine/region_surface.hpp"
#include "stages/refine/surface_elements.hpp"

#include "core/random.hpp"
#include "domain/closest_point.hpp"
#include "mesh/hanging.hpp"
#include "mesh/topology.hpp"
#include "mesh/validate_structure.hpp"
#include "surfaces.hpp"

#include <glm/vector_relational.hpp>
#include <set>

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

namespace {

/// Cells of a mesh whose box holds a point.
template <class Visit>
void visit_around(const RefineOutput& out, const Point& at, const Visit& visit) {
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        const Box box = node_box(out.refinement, out.leaf_node[c]);
        if (glm::all(glm::lessThanEqual(box.low, at)) && glm::all(glm::lessThanEqual(at, box.high))) visit(c);
    }
}

double size_at(const RefineOutput& out, const Point& at) {
    double size = 0;
    visit_around(out, at, [&](Index c) { size = std::max(size, size_range(out.octree, c)[1]); });
    return size;
}

RefineOptions only_sizes(double size) {
    RefineOptions options;
    options.surface.size = size;
    options.normal_angle_deg = 180;
    options.chord_error_rel = 0;
    options.gap_cells = options.wall_cells = options.feature_cells = 0;
    return options;
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
    options.chord_error_rel = 0;
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
    options.chord_error_rel = 0;
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
    // A chord error of 1e-3 of the diagonal (4) asks for size^2 / 8 < 0.004 on the large one.
    options.normal_angle_deg = 180;
    options.chord_error_rel = 1e-3;
    const RefineOutput chords = run(domain, options);
    REQUIRE(size_at(chords, {0, 0, 1}) < 0.2);
    REQUIRE(finest_small < 0.07);
    REQUIRE(coarsest_small < 0.13);
}

namespace {

/// A box whose top is a roof of 2 x 11.3 degrees, in one patch with it.
TriangleSoup make_roof() {
    TriangleSoup soup;
    append_box(soup, {0, 0, 0}, {4, 4, 1});
    const std::array<Point, 6> top = {Point(0, 0, 1), Point(2, 0, 1.4), Point(4, 0, 1),
                                      Point(0, 4, 1), Point(2, 4, 1.4), Point(4, 4, 1)};
    soup.triangles.resize(10);
    soup.patch.resize(10);
    append_quad(soup, {top[0], top[1], top[4], top[3]}, 5);
    append_quad(soup, {top[1], top[2], top[5], top[4]}, 5);
    for (Index end : {0, 1}) { // gables
        const Index first = static_cast<Index>(soup.vertices.size());
        for (Index k : {0, 1, 2}) soup.vertices.push_back(top[3 * end + k]);
        soup.triangles.push_back(end == 0 ? std::array<Index, 3>{first, first + 2, first + 1}
                                          : std::array<Index, 3>{first, first + 1, first + 2});
        soup.patch.push_back(2 + end);
    }
    return soup;
}

RefineOptions only_creases() {
    RefineOptions options;
    options.surface.size = 0.6;
    options.gap_cells = options.wall_cells = options.feature_cells = 0;
    options.normal_angle_deg = 180;
    options.surface_rings = 0;
    return options;
}

} // namespace

TEST_CASE("creases inside a patch are refined until chords across them stay near the surface") {
    const Domain domain = make_domain(make_roof());
    RefineOptions options = only_creases();
    options.chord_error_rel = 0;
    REQUIRE(size_at(run(domain, options), {2, 2, 1.4}) > 0.3);
    options.chord_error_rel = 0.02 / domain.model.diagonal(); // 22.6 degrees times size over 4
    const RefineOutput out = run(domain, options);
    require_sound(out.octree);
    REQUIRE(size_at(out, {2, 2, 1.4}) <= 0.21);
    REQUIRE(size_at(out, {0.3, 2, 0}) > 0.3);
}

TEST_CASE("cells whose chords are twice too far off get one level more") {
    const Domain domain = make_domain(make_roof());
    const auto finest = [&](int levels, double chord_error) {
        RefineOptions options = only_creases();
        options.curvature_levels = levels;
        options.chord_error_rel = chord_error / domain.model.diagonal();
        return size_at(run(domain, options), {2, 2, 1.4});
    };
    const double none = finest(0, 0.012), one = finest(1, 0.02), two = finest(1, 0.012);
    REQUIRE(none > 0.3);
    REQUIRE(one == Approx(none / 2));
    REQUIRE(0.394 / 4 * one < 2 * 0.02);
    REQUIRE(0.394 / 4 * one > 2 * 0.012);
    REQUIRE(two == Approx(none / 4));
    REQUIRE(finest(1, 0.001) == two); // and no more than one
}

TEST_CASE("where cells are counted, steep chords get their level if that does not take many cells") {
    Context context(1);
    RefineOptions options = only_creases();
    options.surface.size = 0;
    options.target_cells = 3000;
    options.curvature_levels = 1;
    SECTION("one crease of a roof") {
        const Domain domain = make_domain(make_roof());
        options.chord_error_rel = 0.003 / domain.model.diagonal();
        auto trials = SizeTrials::create(domain, options, context);
        REQUIRE(trials);
        const auto without = trials->refine_to(0.15);
        REQUIRE(without);
        const auto steep = trials->allow_steep(*without);
        REQUIRE(steep);
        REQUIRE(*steep);
        CHECK((*steep)->cut > without->cut);
        auto later = trials->refine_to(0.15);
        REQUIRE(later);
        CHECK(later->cut == (*steep)->cut);
        options.surface.size = 0.15; // as where the size is given
        CHECK(trials->finish(std::move(*later)).octree.cells == run(domain, options).octree.cells);
    }
    SECTION("facets all over a ball") {
        const Domain domain = make_domain(make_sphere(1, 12));
        options.chord_error_rel = 1e-3;
        auto trials = SizeTrials::create(domain, options, context);
        REQUIRE(trials);
        const auto without = trials->refine_to(0.3);
        REQUIRE(without);
        const auto steep = trials->allow_steep(*without);
        REQUIRE(steep);
        CHECK_FALSE(*steep);
        const auto later = trials->refine_to(0.3);
        REQUIRE(later);
        CHECK(later->out.refinement.leaves() == without->out.refinement.leaves());
        options.surface.size = 0.3;
        CHECK(run(domain, options).octree.cell_count() > 2 * without->out.refinement.leaf_count());
    }
}

TEST_CASE("gaps get their cells, as far as levels allow") {
    // A box with a cavity: 0.3 of mesh on one side of it, 2 on the others.
    TriangleSoup soup;
    append_box(soup, Point(0), Point(4));
    append_box(soup, Point(0.3, 2, 2), Point(2, 3, 3), true);
    const Domain domain = make_domain(soup);
    RefineOptions options = only_sizes(0.25);
    REQUIRE(size_at(run(domain, options), {0.15, 2.5, 2.5}) > 0.2);
    options.gap_cells = 3;
    const RefineOutput out = run(domain, options);
    REQUIRE(out.stats.split[static_cast<std::size_t>(RefineCriterion::gap)] > 0);
    REQUIRE(size_at(out, {0.01, 2.5, 2.5}) <= 0.1);
    REQUIRE(size_at(out, {0.29, 2.5, 2.5}) <= 0.1);
    std::set<Index> across;
    for (double x = 0.005; x < 0.3; x += 0.01)
        visit_around(out, {x, 2.51, 2.51}, [&](Index c) { across.insert(c); });
    REQUIRE(across.size() >= 3);
    REQUIRE(size_at(out, {0.01, 0.5, 0.5}) > 0.2);
    REQUIRE(size_at(out, {2.01, 2.5, 2.5}) > 0.2);
    // Through the cavity, 1.7 by 1 by 1: nine cells want at most 0.111.
    options.gap_cells = 0;
    options.wall_cells = 9;
    const RefineOutput wall = run(domain, options);
    REQUIRE(size_at(wall, {0.31, 2.5, 2.5}) <= 0.19);
    REQUIRE(size_at(wall, {1, 2.01, 2.5}) <= 0.112);
    REQUIRE(size_at(wall, {0.01, 0.5, 0.5}) > 0.2);
    options.gap_levels = 0;
    REQUIRE(run(domain, options).stats.split[static_cast<std::size_t>(RefineCriterion::gap)] == 0);
}

TEST_CASE("a gap too narrow for the last level is left alone") {
    TriangleSoup soup;
    append_box(soup, Point(0), Point(4));
    append_box(soup, Point(0.01, 2, 2), Point(2, 3, 3), true);
    const Domain domain = make_domain(soup);
    RefineOptions options = only_sizes(0.25);
    options.gap_cells = 3;
    REQUIRE(run(domain, options).stats.split[static_cast<std::size_t>(RefineCriterion::gap)] == 0);
    options.gap_levels = 6;
    const RefineOutput out = run(domain, options);
    REQUIRE(size_at(out, {0.001, 2.5, 2.5}) <= 0.004);
}

TEST_CASE("narrow patches, short curves and close curves are refined") {
    // A box with a groove-like step: two boxes side by side would touch; a narrow slab is enough.
    const Domain domain = make_domain(make_box({3, 3, 0.2}));
    RefineOptions options = only_sizes(0.2);
    REQUIRE(size_at(run(domain, options), {0.001, 1.5, 0.1}) > 0.15);
    options.feature_cells = 3;
    const RefineOutput out = run(domain, options);
    REQUIRE(out.stats.split[static_cast<std::size_t>(RefineCriterion::feature)] > 0);
    REQUIRE(size_at(out, {0.001, 1.5, 0.1}) <= 0.2 / 3);
    REQUIRE(size_at(out, {1.5, 1.5, 0.001}) > 0.15);
}

TEST_CASE("curves and regions may ask for a size") {
    const Domain domain = make_domain(make_box({4, 4, 4}));
    RefineOptions options = only_sizes(0.5);
    options.curves = {{"x0", "y0", {0.1, -1}}};
    const RefineOutput curve = run(domain, options);
    REQUIRE(size_at(curve, {0.001, 0.001, 2}) <= 0.1);
    REQUIRE(size_at(curve, {3.999, 0.001, 2}) > 0.3);
    REQUIRE(curve.stats.split[static_cast<std::size_t>(RefineCriterion::curve_size)] > 0);

    options.curves.clear();
    RegionTarget region;
    region.target.size = 0.13;
    region.low = Point(1.5), region.high = Point(2);
    options.regions = {region};
    const RefineOutput box = run(domain, options);
    REQUIRE(size_at(box, Point(1.51)) <= 0.13);
    REQUIRE(size_at(box, Point(2, 1.5, 2)) <= 0.13);
    REQUIRE(size_at(box, Point(3.3)) > 0.3);
    REQUIRE(box.stats.split[static_cast<std::size_t>(RefineCriterion::region)] > 0);

    region.shape = RegionShape::sphere;
    region.low = Point(2), region.radius = 0.2, region.distance = 0.5;
    options.regions = {region};
    const RefineOutput sphere = run(domain, options);
    REQUIRE(size_at(sphere, Point(2.65, 2, 2)) <= 0.13);
    REQUIRE(size_at(sphere, Point(3.6, 2, 2)) > 0.2);

    region.shape = RegionShape::cylinder;
    region.low = Point(2, 2, 1), region.high = Point(2, 2, 3), region.distance = 0;
    options.regions = {region};
    const RefineOutput cylinder = run(domain, options);
    for (double z : {1.01, 1.7, 2.99}) REQUIRE(size_at(cylinder, Point(2.1, 2.1, z)) <= 0.13);
    REQUIRE(size_at(cylinder, Point(3.2, 2, 2)) > 0.2);

    region.shape = RegionShape::patch;
    region.patch = "z1", region.distance = 0.6;
    options.regions = {region};
    const RefineOutput layer = run(domain, options);
    REQUIRE(size_at(layer, Point(2, 2, 3.45)) <= 0.13);
    REQUIRE(size_at(layer, Point(2, 2, 1)) > 0.2);
}

namespace {

std::shared_ptr<const RegionSurface> region_surface(const TriangleSoup& soup) {
    Context context(2);
    auto made = RegionSurface::create(soup, context);
    if (!made) FAIL(made.error().one_line());
    return *made;
}

void append(TriangleSoup& all, const TriangleSoup& part) {
    const Index first = static_cast<Index>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& [a, b, c] : part.triangles) all.triangles.push_back({first + a, first + b, first + c});
    all.patch.resize(all.triangles.size(), 0);
}

} // namespace

TEST_CASE("a region may be what a closed surface encloses, less its cavities") {
    const Domain domain = make_domain(make_box({4, 4, 4}));
    RefineOptions options = only_sizes(0.5);
    // A shell between two spheres; which way the triangles of either point does not matter.
    TriangleSoup shell = make_sphere(1.2, 40, Point(2));
    append(shell, make_sphere(0.5, 40, Point(2)));
    RegionTarget region;
    region.shape = RegionShape::inside;
    region.surface = region_surface(shell);
    region.target.size = 0.07;
    options.regions = {region};
    options.rings = 1;
    const RefineOutput out = run(domain, options);
    REQUIRE(out.stats.split[static_cast<std::size_t>(RefineCriterion::region)] > 0);
    REQUIRE(size_at(out, Point(2.01)) > 0.07); // in the middle of the cavity
    std::size_t inside = 0, outside = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        const bool is_fine = size_range(out.octree, c)[1] <= 0.07;
        const double r = glm::distance(node_box(out.refinement, out.leaf_node[c]).centre(), Point(2));
        if (r > 0.5 && r < 1.2) REQUIRE(is_fine);
        if (r < 0.1 || r > 2.2) REQUIRE_FALSE(is_fine);
        ++(is_fine ? inside : outside);
    }
    REQUIRE(inside > 1000);
    REQUIRE(outside > 100);

    region.distance = 0.6;
    options.regions = {region};
    const RefineOutput wider = run(domain, options);
    for (Index c = 0; c < wider.octree.cell_count(); ++c)
        if (glm::distance(node_box(wider.refinement, wider.leaf_node[c]).centre(), Point(2)) < 1.75)
            REQUIRE(size_range(wider.octree, c)[1] <= 0.07);
    REQUIRE(size_at(wider, Point(3.9)) > 0.2);
}

TEST_CASE("a region may be what is near another surface, closed or not") {
    const Domain domain = make_domain(make_box({4, 4, 4}));
    RefineOptions options = only_sizes(0.5);
    TriangleSoup sheet;
    sheet.patch_names = {"wake"};
    append_quad(sheet, {Point(1, 1, 2), Point(3, 1, 2), Point(3, 3, 2), Point(1, 3, 2)}, 0);
    RegionTarget region;
    region.shape = RegionShape::near;
    region.surface = region_surface(sheet);
    region.target.size = 0.07;
    region.distance = 0.2;
    options.regions = {region};
    const RefineOutput out = run(domain, options);
    for (const Point& p : {Point(2, 2, 2.15), Point(2, 2, 1.85), Point(1, 3, 2.1), Point(3.1, 3.1, 2)})
        REQUIRE(size_at(out, p) <= 0.07);
    for (const Point& p : {Point(2, 2, 3.2), Point(2, 2, 0.8), Point(3.8, 2, 2)})
        REQUIRE(size_at(out, p) > 0.13);

    Context context(1);
    region.shape = RegionShape::inside; // the sheet encloses nothing
    region.file = "wake.stl";
    options.regions = {region};
    const auto refused = refine(domain, options, context);
    REQUIRE_FALSE(refused);
    REQUIRE(refused.error().code == ErrorCode::bad_input);
    REQUIRE(refused.error().one_line().find("wake.stl") != std::string::npos);
    REQUIRE(refused.error().one_line().find("4 open edges") != std::string::npos);
}

TEST_CASE("a region may have a size along each axis") {
    const Domain domain = make_domain(make_box({4, 4, 4}));
    RefineOptions options = only_sizes(0.5);
    RegionTarget region;
    region.low = Point(1.5), region.high = Point(2.5);
    region.sizes = {0.5, 0.26, 0.07};
    options.regions = {region};
    const RefineOutput out = run(domain, options);
    require_sound(out.octree);
    REQUIRE(max_hanging_deviation(out.octree.hanging, out.octree.positions) == 0);
    std::size_t inside = 0, flat = 0;
    double volume = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        const Box box = node_box(out.refinement, out.leaf_node[c]);
        const Point size = box.high - box.low;
        volume += size.x * size.y * size.z;
        bool meets = true;
        for (int d = 0; d < 3; ++d) {
            meets = meets && box.low[d] < 2.5 && box.high[d] > 1.5;
            REQUIRE(size[d] <= 0.5 + 1e-9);
        }
        if (!meets) continue;
        ++inside;
        for (int d = 0; d < 3; ++d) REQUIRE(size[d] <= (*region.sizes)[static_cast<std::size_t>(d)] + 1e-9);
        flat += size.x > 3 * size.z;
    }
    REQUIRE(inside > 50);
    REQUIRE(flat > inside / 2);
    Box frame;
    for (const Point& p : out.octree.positions) frame.add(p);
    const Point extent = frame.high - frame.low;
    REQUIRE(volume == Approx(extent.x * extent.y * extent.z).epsilon(1e-12));
    REQUIRE(out.stats.split[static_cast<std::size_t>(RefineCriterion::region)] > 50);

    options.max_cells = out.octree.cell_count() * 9 / 10; // kept to, and said
    const RefineOutput less = run(domain, options);
    REQUIRE(less.octree.cell_count() <= options.max_cells);
    REQUIRE(less.stats.budget_hit());
    CHECK(less.stats.describe_budget().find(" for region") != std::string::npos);
    CHECK(out.stats.describe_budget().empty());
}

TEST_CASE("without a size the number of cells inside is about the wanted one") {
    const Domain domain = make_domain(make_sphere(1, 60));
    RefineOptions options;
    options.target_cells = 20e3;
    const RefineOutput out = run(domain, options);
    std::size_t inside = 0;
    for (Index c = 0; c < out.octree.cell_count(); ++c) {
        Point centre(0);
        for (Index v : out.octree.cells[c]) centre += out.octree.positions[v] / 8.0;
        inside += glm::length(centre) < 1;
    }
    REQUIRE(inside > 8e3);
    REQUIRE(inside < 30e3);
    REQUIRE(out.stats.surface_size > 0);
    REQUIRE(out.stats.level_cells.size() > 1);
}

TEST_CASE("the box round a body gets larger cells unless a size is given") {
    TriangleSoup soup;
    append_box(soup, Point(0), Point(10));
    append_box(soup, Point(4.1, 4.2, 4.3), Point(5.5, 5.4, 5.6), true);
    const Domain domain = make_domain(soup);
    RefineOptions options;
    options.target_cells = 10e3;
    const RefineOutput out = run(domain, options);
    const double on_body = size_at(out, {4.1, 4.8, 4.8}), on_box = size_at(out, {0, 2.03, 2.03});
    REQUIRE(on_body <= out.stats.surface_size);
    REQUIRE(on_box > 3 * on_body);
    REQUIRE(on_box <= 8 * out.stats.surface_size);
    options.outer_levels = 0;
    const RefineOutput even = run(domain, options);
    REQUIRE(size_at(even, {0, 2.03, 2.03}) <= even.stats.surface_size);
    // Without a body the box is what is meshed.
    const Domain box = make_domain(make_box({4, 4, 4}));
    options.outer_levels = 3;
    const RefineOutput plain = run(box, options);
    REQUIRE(size_at(plain, {0, 2.03, 2.03}) <= plain.stats.surface_size);
}

TEST_CASE(
    "a plane of symmetry that runs smoothly into the body belongs to the outer box, the body does not") {
    TriangleSoup soup;
    append_box(soup, {-4, -4, 0}, {4, 4, 8});
    const Index ground = 4; // z0
    for (std::size_t t = soup.triangles.size(); t-- > 0;)
        if (soup.patch[t] == ground) {
            soup.triangles.erase(soup.triangles.begin() + static_cast<std::ptrdiff_t>(t));
            soup.patch.erase(soup.patch.begin() + static_cast<std::ptrdiff_t>(t));
        }
    const int n = 64;
    const auto at = [&](int i, int j) {
        const double x = 8.0 * i / n - 4, y = 8.0 * j / n - 4, r = std::hypot(x, y);
        return Point(x, y, r < 1 ? 0.15 * (1 + std::cos(std::numbers::pi * r)) : 0);
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            append_quad(soup, {at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)}, ground);
    const Domain domain = make_domain(soup);
    RefineOptions options;
    options.target_cells = 30e3;
    options.feature_cells = options.gap_cells = options.wall_cells = 0; // the ground's rim does not match
    const RefineOutput out = run(domain, options);
    REQUIRE(size_at(out, {0.5, 0, at(n / 2 + 4, n / 2).z}) <= out.stats.surface_size);
    REQUIRE(size_at(out, {-3.2, -3.1, 0.01}) > 3 * out.stats.surface_size);
    REQUIRE(size_at(out, {3.99, 3, 7}) > 3 * out.stats.surface_size);
}

TEST_CASE("a planar run refines in the plane only") {
    // A square with a hole, one unit thick.
    TriangleSoup soup;
    append_box(soup, Point(0, 0, -0.5), Point(4, 4, 0.5));
    append_box(soup, Point(1, 1, -0.5), Point(1.5, 1.5, 0.5), true);
    // The hole's ends would close it: its z patches go.
    const Index low = 10, high = 11;
    for (std::size_t t = soup.triangles.size(); t-- > 0;)
        if (soup.patch[t] == low || soup.patch[t] == high) {
            soup.triangles.erase(soup.triangles.begin() + static_cast<std::ptrdiff_t>(t));
            soup.patch.erase(soup.patch.begin() + static_cast<std::ptrdiff_t>(t));
        }
    const Domain domain = make_domain(soup);
    RefineOptions options;
    options.planar = true;
    options.target_cells = 2000;
    const RefineOutput out = run(domain, options);
    require_sound(out.octree);
    REQUIRE(out.octree.cell_count() > 500);
    REQUIRE(out.octree.cell_count() < 10000);
    for (const Point& p : out.octree.positions) REQUIRE(std::abs(p.z) == 0.5);
    REQUIRE(size_at(out, {3, 3, 0}) > 2 * out.stats.surface_size);
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
    REQUIRE(out.stats.budget_hit());
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
    refused([](RefineOptions& o) { o.target_cells = -1; });
    refused([](RefineOptions& o) { o.surface.size = -1; });
    refused([](RefineOptions& o) { o.initial.base_size = std::nan(""); });
    refused([](RefineOptions& o) { o.surface = {0.1, 2}; });
    refused([](RefineOptions& o) { o.gap_cells = -1; });
    refused([](RefineOptions& o) { o.wall_cells = 101; });
    refused([](RefineOptions& o) { o.feature_cells = std::nan(""); });
    refused([](RefineOptions& o) { o.max_level = -1; });
    refused([](RefineOptions& o) { o.initial.base_size = 1e-9; });
    refused([](RefineOptions& o) { o.initial.cells = {1, 0, 2}; });
    refused([](RefineOptions& o) { o.initial.cells = {1, 9000, 2}; });
    refused([](RefineOptions& o) { o.patches = {{"x0", {}}}; });
    refused([](RefineOptions& o) { o.curves = {{"x0", "", {}}}; });
    refused([](RefineOptions& o) { o.curves = {{"x0", "y9", {0.1, -1}}}; });
    refused([](RefineOptions& o) { o.curves = {{"x0", "x1", {0.1, -1}}}; }); // opposite sides
    refused([](RefineOptions& o) { o.regions.resize(1); });
    const auto refused_region = [&](auto change) {
        refused([&](RefineOptions& o) {
            o.regions.resize(1);
            o.regions[0].target.size = 0.1;
            change(o.regions[0]);
        });
    };
    refused_region([](RegionTarget& r) { r.high = {1, -1, 1}; });
    refused_region([](RegionTarget& r) { r.distance = -1; });
    refused_region([](RegionTarget& r) { r.shape = RegionShape::sphere; });
    refused_region([](RegionTarget& r) { r.shape = RegionShape::cylinder, r.radius = 1; });
    refused_region([](RegionTarget& r) { r.shape = RegionShape::patch, r.patch = "none"; });
    refused_region([](RegionTarget& r) { r.shape = RegionShape::near; });
    refused_region([](RegionTarget& r) { r.sizes = {1, 1, 1}; }); // beside one size
    refused_region([](RegionTarget& r) { r.target = {}, r.sizes = {1, 1, 0}; });
    refused([](RefineOptions& o) {
        o.regions.resize(1);
        o.regions[0].sizes = {0.1, 0.1, 0.01};
        o.planar = true;
    });
    refused([](RefineOptions& o) {
        o.initial.mesh = HexMesh{};
        o.initial.base_size = 1;
    });
    refused([](RefineOptions& o) { o.initial.box = Box{Point(0), Point(1, 0, 1)}; });
    context.cancel();
    REQUIRE(refine(domain, {}, context).error().code == ErrorCode::cancelled);
}
