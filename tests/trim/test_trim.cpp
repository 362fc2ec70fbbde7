// Trimming of octrees round simple shapes: what is kept, the surface that is left, determinism.
#include "core/random.hpp"
#include "domain/orient_surface.hpp"
#include "domain/surface_queries.hpp"
#include "mesh/hanging.hpp"
#include "mesh/refine_cells.hpp"
#include "mesh/validate_structure.hpp"
#include "stages/refine/initial_mesh.hpp"
#include "stages/trim/trim.hpp"
#include "support/shapes.hpp"
#include "trim/surface_octree.hpp"

#include <catch2/catch.hpp>
#include <map>

using namespace hexopt;

namespace {

Domain domain_of(const TriangleSoup& soup) {
    Context context(1);
    Result<OrientedSurface> oriented = orient_surface(soup, context);
    if (!oriented) FAIL(oriented.error().one_line());
    Result<Domain> domain = build_domain(oriented->soup, {}, context);
    if (!domain) FAIL(domain.error().one_line());
    return std::move(domain).value();
}

struct Trimmed {
    HexMesh octree;
    TrimOutput out;
    int rounds = 0;
};

/// Refines and trims until nothing is to be refined. Levels: all but the last near the surface, the last near
/// the surface where x + y > 0 only, so that fronts between levels cross the surface.
Trimmed refine_and_trim(const Domain& domain, std::uint32_t roots, int levels, const TrimOptions& options,
                        int threads = 1) {
    SurfaceOctree octree = octree_round(surface_box(domain.model), roots);
    const auto near = [&](const Point& p, double edge, int level) {
        return domain.model.distance(p) < 1.4 * edge && (level + 1 < levels || p.x + p.y > 0);
    };
    Context context(threads);
    Trimmed result;
    for (int deepest = levels; result.rounds < 15; ++result.rounds) {
        result.octree = octree.make(deepest, near);
        Result<TrimOutput> out = trim(result.octree, domain, options, context);
        if (!out) FAIL(out.error().one_line());
        result.out = std::move(out).value();
        if (result.out.refine_cells.empty()) break;
        octree.ask(result.octree, result.out.refine_cells);
        for (Index c : result.out.refine_cells) deepest = std::max(deepest, result.octree.level[c] + 1);
    }
    return result;
}

Point centre_of(const HexMesh& mesh, Index cell) {
    Point sum(0);
    for (Index v : mesh.cells[cell]) sum += mesh.positions[v];
    return sum / 8.0;
}

void check_sound(const Trimmed& trimmed) {
    const TrimOutput& out = trimmed.out;
    CHECK(out.refine_cells.empty());
    CHECK(out.report.closed_manifold());
    CHECK(validate_structure(out.kept, Parallel(1)).empty());
    CHECK(max_hanging_deviation(out.kept.hanging, out.kept.positions) < 1e-12);
    CHECK(out.kept_cell.size() == out.kept.cell_count());
    for (Index c = 0; c < out.kept_cell.size(); ++c)
        REQUIRE(glm::length(centre_of(out.kept, c) - centre_of(trimmed.octree, out.kept_cell[c])) == 0);
    std::vector<std::uint8_t> used(out.kept.vertex_count(), 0);
    for (const Cell& cell : out.kept.cells)
        for (Index v : cell) used[v] = 1;
    CHECK(std::count(used.begin(), used.end(), 0) == 0);
}

struct Shape {
    const char* name;
    TriangleSoup soup;
    int euler; ///< of the surface: 2 - 2 genus
};

/// V - E + F of the boundary with hanging vertices inserted, counted from vertex positions on quad edges.
int euler_of(const HexMesh& mesh) {
    const Topology topology = compute_topology(mesh);
    std::map<std::array<Index, 2>, int> edges;
    std::set<Index> vertices;
    for (CellFace face : topology.boundary_faces) {
        const Quad q = face_vertices(mesh, face);
        vertices.insert(q.begin(), q.end());
        for (int k = 0; k < 4; ++k) ++edges[{std::min(q[k], q[(k + 1) % 4]), std::max(q[k], q[(k + 1) % 4])}];
    }
    // An edge used once is a coarse one, which two fine ones replace, or one of those.
    std::map<std::array<double, 3>, Index> middles;
    for (const auto& [edge, uses] : edges) {
        if (uses == 2) continue;
        const Point p = 0.5 * (mesh.positions[edge[0]] + mesh.positions[edge[1]]);
        middles[{std::round(p.x * 1e9), std::round(p.y * 1e9), std::round(p.z * 1e9)}] = 1;
    }
    int coarse = 0;
    for (Index v : vertices) {
        const Point& p = mesh.positions[v];
        coarse += static_cast<int>(
            middles.count({std::round(p.x * 1e9), std::round(p.y * 1e9), std::round(p.z * 1e9)}));
    }
    return static_cast<int>(vertices.size()) - (static_cast<int>(edges.size()) - coarse) +
           static_cast<int>(topology.boundary_faces.size());
}

std::vector<Shape> make_shapes(const glm::dmat3& turn) {
    std::vector<Shape> shapes = {{"sphere", make_sphere_surface(Point(0), 1), 2},
                                 {"box", make_box_surface(Point(-1, -0.7, -0.4), Point(1, 0.7, 0.4)), 2},
                                 {"torus", make_torus_surface(1, 0.45), 0}};
    for (Shape& shape : shapes)
        for (Point& p : shape.soup.vertices) p = turn * p;
    return shapes;
}

} // namespace

TEST_CASE("trimmed shapes in any direction have a closed manifold surface of the right genus") {
    Random random(3);
    for (int round = 0; round < 3; ++round)
        for (const Shape& shape : make_shapes(random_rotation(random)))
            for (TrimRule rule : {TrimRule::centre, TrimRule::strict})
                for (int levels : {0, 2}) {
                    INFO(shape.name << " " << levels << " levels, rule " << int(rule));
                    const Domain domain = domain_of(shape.soup);
                    TrimOptions options;
                    options.rule = rule;
                    // The strict rule takes a layer more, which thin parts of large cells would not survive.
                    const std::uint32_t roots = levels == 0 ? 24 : rule == TrimRule::strict ? 15 : 11;
                    const Trimmed trimmed = refine_and_trim(domain, roots, levels, options);
                    check_sound(trimmed);
                    CHECK(trimmed.out.report.parts == 1);
                    CHECK(euler_of(trimmed.out.kept) == shape.euler);
                    if (levels > 0) CHECK_FALSE(trimmed.out.kept.hanging.empty());
                }
}

TEST_CASE("octrees cut along single axes are trimmed, their hanging vertices where they were") {
    const Domain domain = domain_of(make_sphere_surface(Point(0), 1, 24));
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        INFO("seed " << seed);
        Random random(seed);
        auto made =
            CellRefinement::create(make_box_mesh({Point(-1.31), Point(1.29)}, {5, 5, 5}), Parallel(1));
        REQUIRE(made);
        for (int round = 0; round < 4; ++round) {
            const std::vector<Index> leaves = made->leaves();
            std::vector<RefineRequest> requests;
            for (int i = 0; i < 15; ++i)
                requests.push_back({leaves[random.below(leaves.size())],
                                    static_cast<AxisMask>(1 + random.below(round == 3 ? 1 : 7))});
            if (round == 3) // whole cells last, as repairs do it
                for (RefineRequest& request : requests) request.mask = kAllAxes;
            made->refine(requests);
        }
        Trimmed trimmed;
        trimmed.octree = made->leaf_mesh(Parallel(1)).mesh;
        TrimOptions options;
        options.partial = PartialFaces::remove;
        Context context(1);
        auto out = trim(trimmed.octree, domain, options, context);
        INFO((out ? "" : out.error().one_line()));
        REQUIRE(out);
        trimmed.out = std::move(*out);
        REQUIRE_FALSE(trimmed.out.kept.hanging.empty());
        check_sound(trimmed);
    }
}

TEST_CASE("removing partial faces does not spread along fronts between levels") {
    const Domain domain = domain_of(make_torus_surface(1, 0.45));
    for (const double offset : {0.0, 0.11, 0.23, 0.37, 0.52}) {
        INFO("front at " << offset);
        SurfaceOctree made = octree_round(surface_box(domain.model), 11);
        Trimmed trimmed;
        trimmed.octree = made.make(2, [&](const Point& p, double edge, int level) {
            return domain.model.distance(p) < 1.4 * edge && (level == 0 || p.x + 0.4 * p.y > offset);
        });
        TrimOptions options;
        Context context(1);
        const auto asked = trim(trimmed.octree, domain, options, context);
        REQUIRE(asked);
        REQUIRE_FALSE(asked->refine_cells.empty());
        options.count_faults = false;
        auto uncounted = trim(trimmed.octree, domain, options, context);
        REQUIRE(uncounted);
        CHECK(uncounted->report.surface_quads == 0);
        count_faults(*uncounted, context.parallel());
        CHECK(uncounted->report.surface_quads == asked->report.surface_quads);
        CHECK(uncounted->report.surface_quads > 0);
        options.count_faults = true;
        options.partial = PartialFaces::remove;
        auto out = trim(trimmed.octree, domain, options, context);
        REQUIRE(out);
        trimmed.out = std::move(*out);
        check_sound(trimmed);
        CHECK(trimmed.out.report.partial_removed <= 2 * asked->refine_cells.size());
    }
}

TEST_CASE("cells are kept by the depth of their centres, or whole") {
    const Domain domain = domain_of(make_sphere_surface(Point(0), 1, 48));
    TrimOptions options;
    const Trimmed centre = refine_and_trim(domain, 20, 0, options);
    const double h = 0.1; // two over twenty
    std::vector<std::uint8_t> kept(centre.octree.cell_count(), 0);
    for (Index c : centre.out.kept_cell) kept[c] = 1;
    std::size_t wrong = 0;
    for (Index c = 0; c < kept.size(); ++c) {
        const double depth = 1 - glm::length(centre_of(centre.octree, c));
        if (std::abs(depth - 0.1 * h) > 0.002) wrong += kept[c] != (depth > 0.1 * h);
    }
    CHECK(centre.out.report.kept_volume == Approx(double(centre.out.kept.cell_count()) * h * h * h));
    CHECK(centre.out.report.enclosed_volume == Approx(4.19).epsilon(0.005));
    // A few cells are mended away.
    CHECK(wrong <= centre.out.report.manifold_removed + centre.out.report.tips_removed +
                       centre.out.report.pits_filled);
    options.rule = TrimRule::strict;
    const Trimmed strict = refine_and_trim(domain, 20, 0, options);
    CHECK(strict.out.kept_cell.size() < centre.out.kept_cell.size());
    for (Index c : strict.out.kept_cell)
        for (Index v : strict.octree.cells[c]) REQUIRE(glm::length(strict.octree.positions[v]) < 1);
}

TEST_CASE("the same cells are kept for any number of threads") {
    const Domain domain = domain_of(make_torus_surface(1, 0.45));
    const Trimmed one = refine_and_trim(domain, 11, 2, {}, 1), three = refine_and_trim(domain, 11, 2, {}, 3);
    CHECK(one.out.kept_cell == three.out.kept_cell);
    CHECK(one.out.kept.cells == three.out.kept.cells);
    CHECK(one.out.kept.hanging.master == three.out.kept.hanging.master);
}

TEST_CASE("seeds choose parts and sides of the surface") {
    TriangleSoup two = make_sphere_surface(Point(-2, 0, 0), 1);
    append_soup(two, make_sphere_surface(Point(2, 0, 0), 0.7));
    const Domain domain = domain_of(two);
    TrimOptions options;
    CHECK(refine_and_trim(domain, 40, 0, options).out.report.parts == 2);
    options.part_fraction = 1;
    const Trimmed largest = refine_and_trim(domain, 40, 0, options);
    CHECK(largest.out.report.parts == 1);
    CHECK(largest.out.report.part_cells_dropped > 0);
    for (const Point& p : largest.out.kept.positions) REQUIRE(p.x < 0);
    options.seeds = {Point(2.1, 0, 0.1)};
    const Trimmed right = refine_and_trim(domain, 40, 0, options);
    for (const Point& p : right.out.kept.positions) REQUIRE(p.x > 0);
    check_sound(right);
    options.seeds.push_back(Point(-2, 0, 0));
    CHECK(refine_and_trim(domain, 40, 0, options).out.report.parts == 2);

    // The hollow of a shell, which is outside of what the shell bounds.
    TriangleSoup shell = make_sphere_surface(Point(0), 1);
    append_soup(shell, make_sphere_surface(Point(0), 0.6));
    options.seeds = {Point(0.1, 0, 0)};
    const Trimmed hollow = refine_and_trim(domain_of(shell), 30, 0, options);
    check_sound(hollow);
    for (const Point& p : hollow.out.kept.positions) REQUIRE(glm::length(p) < 0.7);
}

TEST_CASE("a leak is refused with a shortest path of cells to the outside") {
    TriangleSoup holed = make_sphere_surface(Point(0), 1, 16);
    std::erase_if(holed.triangles, [&](const auto& t) { return holed.vertices[t[0]].z > 0.8; });
    const Domain domain = domain_of(holed);
    SurfaceOctree octree = octree_round(surface_box(domain.model), 24);
    const HexMesh mesh = octree.make(0, [](const Point&, double, int) { return false; });
    Context context(1);
    TrimOptions options;
    options.rule = TrimRule::strict;
    options.seeds = {Point(0.02, 0.03, 0)};
    std::vector<Index> path;
    const Result<TrimOutput> leaking = trim(mesh, domain, options, context, &path);
    REQUIRE_FALSE(leaking);
    CHECK(leaking.error().code == ErrorCode::bad_input);
    CHECK(leaking.error().one_line().find("leaks") != std::string::npos);
    REQUIRE(path.size() > 5);
    const double h = 2.0 / 24;
    CHECK(glm::length(centre_of(mesh, path[0]) - options.seeds[0]) < h);
    bool through_hole = false;
    for (std::size_t i = 1; i < path.size(); ++i) {
        const Point a = centre_of(mesh, path[i - 1]), b = centre_of(mesh, path[i]);
        CHECK(std::abs(glm::length(a - b) - h) < 1e-9);
        if (glm::length(a) < 1 && glm::length(b) >= 1) through_hole = a.z > 0.7;
    }
    CHECK(through_hole);
    // Straight up: the shortest of all.
    CHECK(path.size() <= std::size_t((surface_box(domain.model).high.z + 2 * h) / h) + 4);

    options.rule = TrimRule::centre; // closes the hole
    const Result<TrimOutput> closed = trim(mesh, domain, options, context, &path);
    REQUIRE(closed);
    CHECK(closed->report.closed_manifold());
    options.seeds = {Point(1.02, 0.97, -0.95)};
    const Result<TrimOutput> outside = trim(mesh, domain, options, context, &path);
    REQUIRE_FALSE(outside);
    CHECK(outside.error().one_line().find("outside") != std::string::npos);
    options.seeds = {Point(100, 0, 0)};
    CHECK_FALSE(trim(mesh, domain, options, context));
    options.seeds.clear();
    options.depth_h = 0.6;
    CHECK(trim(mesh, domain, options, context).error().code == ErrorCode::usage);
}

TEST_CASE("neighbours on either side of a gap do not share a face, solids that touch do") {
    for (double gap : {0.0, 1e-7, 0.02, 0.3}) {
        INFO("gap of " << gap << " cells");
        const double h = 2.0 / 20;
        TriangleSoup pair = make_box_surface(Point(-1, -0.5, -0.5), Point(0, 0.5, 0.5), 5);
        append_soup(pair, make_box_surface(Point(gap * h, -0.5, -0.5), Point(1, 0.5, 0.5), 5));
        const Domain domain = domain_of(pair);
        for (double offset : {0.11, 0.37, 0.52, 0.93}) {
            SurfaceOctree octree = octree_round(surface_box(domain.model), 20, offset);
            const HexMesh mesh = octree.make(0, [](const Point&, double, int) { return false; });
            Context context(1);
            const Result<TrimOutput> out = trim(mesh, domain, {}, context);
            REQUIRE(out);
            CHECK(out->report.closed_manifold());
            CHECK(out->report.parts == (gap < 1e-3 ? 1u : 2u));
            if (gap < 1e-3) CHECK(out->report.gap_removed == 0);
        }
    }
}

TEST_CASE("notches where walls meet are no gaps, but where a common face is almost all in the notch") {
    Random random(5);
    for (int round = 0; round < 4; ++round) {
        TriangleSoup cross = make_box_surface(Point(-1, -0.25, -0.4), Point(1, 0.25, 0.4), 3);
        append_soup(cross, make_box_surface(Point(-0.25, -1, -0.41), Point(0.25, 1, 0.41), 3));
        const double s = std::sqrt(0.5);
        const glm::dmat3 turn = round == 0 ? glm::dmat3(s, s, 0, -s, s, 0, 0, 0, 1) : random_rotation(random);
        for (Point& p : cross.vertices) p = turn * p;
        const Domain domain = domain_of(cross);
        for (double offset : {0.11, 0.37, 0.52, 0.93}) {
            SurfaceOctree octree = octree_round(surface_box(domain.model), 20, offset);
            const HexMesh mesh = octree.make(0, [](const Point&, double, int) { return false; });
            Context context(1);
            const Result<TrimOutput> out = trim(mesh, domain, {}, context);
            REQUIRE(out);
            CHECK(out->report.closed_manifold());
            CHECK(out->report.gap_removed <= 2);
        }
    }
}
