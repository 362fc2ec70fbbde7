#include "mesh/refine_cells.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"
#include "mesh/recognise_hanging.hpp"
#include "mesh/validate_structure.hpp"
#include "mesh_oracles.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <set>

using namespace hexopt;

namespace {

HexMesh make_grid(std::array<Index, 3> cells) {
    HexMesh mesh;
    const auto at = [&](Index i, Index j, Index k) { return i + (cells[0] + 1) * (j + (cells[1] + 1) * k); };
    for (Index k = 0; k <= cells[2]; ++k)
        for (Index j = 0; j <= cells[1]; ++j)
            for (Index i = 0; i <= cells[0]; ++i) mesh.positions.emplace_back(i, j, k);
    for (Index k = 0; k < cells[2]; ++k)
        for (Index j = 0; j < cells[1]; ++j)
            for (Index i = 0; i < cells[0]; ++i) {
                Cell cell;
                for (int v = 0; v < 8; ++v)
                    cell[v] = at(i + hex::kVertexX[v], j + hex::kVertexY[v], k + hex::kVertexZ[v]);
                mesh.cells.push_back(cell);
            }
    return mesh;
}

/// Turns every cell about its own centre by one of the 24 rotations and numbers the vertices anew.
void twist(HexMesh& mesh, std::uint64_t seed) {
    Random random(seed);
    constexpr Cell kQuarterX = {3, 2, 6, 7, 0, 1, 5, 4}, kQuarterZ = {3, 0, 1, 2, 7, 4, 5, 6};
    for (Cell& cell : mesh.cells)
        for (int turns = 0; turns < 6; ++turns) {
            const Cell& by = random.below(2) ? kQuarterX : kQuarterZ;
            Cell turned;
            for (int k = 0; k < 8; ++k) turned[k] = cell[by[k]];
            cell = turned;
        }
    std::vector<Index> number(mesh.vertex_count());
    for (Index v = 0; v < number.size(); ++v) number[v] = v;
    for (std::size_t v = number.size(); v-- > 1;) std::swap(number[v], number[random.below(v + 1)]);
    std::vector<Point> moved(mesh.positions.size());
    for (Index v = 0; v < number.size(); ++v) moved[number[v]] = mesh.positions[v];
    mesh.positions = moved;
    for (Cell& cell : mesh.cells)
        for (Index& v : cell) v = number[v];
}

/// A ball of seven cells round a cube: edges with three cells, a vertex with four.
HexMesh make_ball() {
    HexMesh mesh;
    for (double r : {1.0, 2.0})
        for (int v = 0; v < 8; ++v)
            mesh.positions.push_back(
                r * (2.0 * Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]) - Point(1)));
    mesh.cells.push_back({0, 1, 2, 3, 4, 5, 6, 7});
    for (const auto& face : hex::kFaceVertex) {
        Cell cell;
        for (int k = 0; k < 4; ++k) {
            cell[k] = face[k];
            cell[k + 4] = face[k] + 8u;
        }
        mesh.cells.push_back(cell);
    }
    return mesh;
}

void jitter(HexMesh& mesh, double amount) {
    Random random(7);
    for (Point& p : mesh.positions)
        for (int d = 0; d < 3; ++d) p[d] += random.uniform(-amount, amount);
}

CellRefinement start(const HexMesh& roots) {
    auto made = CellRefinement::create(roots, Parallel(1));
    if (!made) FAIL(made.error().one_line());
    return std::move(made).value();
}

/// Boundary of the roots in area vectors and the leaves' must agree; faces between levels must all be
/// matched.
void require_sound(const HexMesh& roots, const CellRefinement& refinement) {
    const Parallel parallel(2);
    const LeafMesh out = refinement.leaf_mesh(parallel);
    REQUIRE(out.mesh.cell_count() == refinement.leaf_count());
    for (const Violation& violation : validate_structure(out.mesh, parallel)) FAIL(violation.one_line());
    REQUIRE(max_hanging_deviation(out.mesh.hanging, out.mesh.positions) == 0);
    REQUIRE(test::volume_of_cells(out.mesh) == Approx(test::volume_of_cells(roots)).epsilon(1e-12));
    const auto boundary_flux = [](const HexMesh& mesh) {
        const Topology topology = compute_topology(mesh);
        double area = 0, flux = 0;
        for (CellFace face : topology.boundary_faces) {
            const Quad q = face_vertices(mesh, face);
            const auto& x = mesh.positions;
            area += glm::length(glm::cross(x[q[2]] - x[q[0]], x[q[3]] - x[q[1]])) / 2;
            flux += test::flux_through(mesh, face);
        }
        return std::pair(area, flux);
    };
    const auto [area, flux] = boundary_flux(out.mesh);
    const auto [root_area, root_flux] = boundary_flux(roots);
    REQUIRE(flux == Approx(root_flux).epsilon(1e-12));
    if (roots.positions[0] == glm::round(roots.positions[0]))
        REQUIRE(area == Approx(root_area).epsilon(1e-12));
}

/// Cells that touch, by brute force from the geometry of an axis-parallel mesh.
void require_balanced(const CellRefinement& refinement, int limit) {
    const std::vector<Index> leaves = refinement.leaves();
    const auto box = [&](Index leaf) {
        const RefineNode& node = refinement.node(leaf);
        Point low = refinement.position(node.vertices[0]), high = low;
        for (Index v : node.vertices) {
            low = glm::min(low, refinement.position(v));
            high = glm::max(high, refinement.position(v));
        }
        return std::pair(low, high);
    };
    for (std::size_t i = 0; i < leaves.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const auto [la, ha] = box(leaves[i]);
            const auto [lb, hb] = box(leaves[j]);
            bool touch = true;
            for (int d = 0; d < 3; ++d) touch = touch && la[d] <= hb[d] && lb[d] <= ha[d];
            if (!touch) continue;
            for (int d = 0; d < 3; ++d) {
                const bool shared = std::max(la[d], lb[d]) < std::min(ha[d], hb[d]);
                const double ratio = (ha[d] - la[d]) / (hb[d] - lb[d]);
                if (shared || limit == 1) REQUIRE((ratio <= 2 && ratio >= 0.5));
            }
        }
}

} // namespace

TEST_CASE("isotropic refinement of boxes is balanced over faces, edges and vertices") {
    const HexMesh roots = make_grid({2, 3, 2});
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        CellRefinement refinement = start(roots);
        Random random(seed);
        for (int round = 0; round < 5; ++round) {
            const std::vector<Index> leaves = refinement.leaves();
            std::vector<RefineRequest> requests;
            for (int k = 0; k < 2; ++k) requests.push_back({leaves[random.below(leaves.size())]});
            const RefineCount count = refinement.refine(requests);
            REQUIRE(count.refused == 0);
            REQUIRE(count.requested >= 1);
        }
        require_sound(roots, refinement);
        require_balanced(refinement, 1);
    }
}

TEST_CASE("a deep corner is refined with one level a ring") {
    const HexMesh roots = make_grid({1, 1, 1});
    CellRefinement refinement = start(roots);
    Index corner = 0;
    for (int level = 0; level < 6; ++level) {
        refinement.refine(std::vector<RefineRequest>{{corner}});
        corner = refinement.node(corner).first_child;
    }
    require_sound(roots, refinement);
    require_balanced(refinement, 1);
    // Towards a corner of the box no balance split is ever needed: 7 cells stay on each level.
    REQUIRE(refinement.leaf_count() == 1 + 6 * 7);
}

TEST_CASE("turned and renumbered cells give the same leaves") {
    HexMesh roots = make_grid({3, 2, 2});
    const auto refine_near = [](const HexMesh& mesh, AxisMask mask) {
        CellRefinement refinement = start(mesh);
        for (int round = 0; round < 4; ++round) {
            std::vector<RefineRequest> requests;
            for (Index leaf : refinement.leaves()) {
                Point low(1e9), high(-1e9);
                for (Index v : refinement.node(leaf).vertices) {
                    low = glm::min(low, refinement.position(v));
                    high = glm::max(high, refinement.position(v));
                }
                const Point p(1.3, 1.1, 0.9);
                if (glm::all(glm::lessThanEqual(low, p)) && glm::all(glm::lessThanEqual(p, high)))
                    requests.push_back({leaf, mask});
            }
            refinement.refine(requests);
        }
        return refinement;
    };
    const CellRefinement plain = refine_near(roots, kAllAxes);
    HexMesh turned = roots;
    twist(turned, 3);
    const CellRefinement other = refine_near(turned, kAllAxes);
    REQUIRE(other.leaf_count() == plain.leaf_count());
    REQUIRE(other.vertex_count() == plain.vertex_count());
    require_sound(turned, other);
    require_balanced(other, 1);
}

TEST_CASE("random anisotropic refinement leaves no face unmatched") {
    std::vector<HexMesh> all = {make_grid({2, 2, 1}), make_grid({1, 1, 1}), make_ball(),
                                make_grid({2, 2, 2})};
    twist(all[3], 5);
    HexMesh bent = make_grid({2, 2, 2});
    twist(bent, 9);
    jitter(bent, 0.15);
    all.push_back(bent);
    HexMesh ball = make_ball();
    twist(ball, 11);
    all.push_back(ball);
    for (std::size_t m = 0; m < all.size(); ++m)
        for (std::uint64_t seed = 1; seed <= 8; ++seed) {
            CAPTURE(m, seed);
            CellRefinement refinement = start(all[m]);
            Random random(seed, m);
            for (int round = 0; round < 6; ++round) {
                const std::vector<Index> leaves = refinement.leaves();
                std::vector<RefineRequest> requests;
                for (int k = 0; k < 2; ++k)
                    requests.push_back(
                        {leaves[random.below(leaves.size())], static_cast<AxisMask>(1 + random.below(7))});
                refinement.refine(requests);
            }
            require_sound(all[m], refinement);
            if (m < 2) require_balanced(refinement, 0);
        }
}

TEST_CASE("the mixed balance of isotropic cuts is the uniform one") {
    const HexMesh roots = make_grid({2, 2, 2});
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        // One cut of another pattern in a far corner switches the balance; it is the same cell in both.
        const auto refine_all = [&](bool mixed) {
            CellRefinement refinement = start(roots);
            if (mixed) {
                // All eight cells in two steps: the same leaves, but different masks.
                std::vector<RefineRequest> first, second;
                for (Index c = 0; c < 8; ++c) first.push_back({c, 1});
                refinement.refine(first);
                for (Index leaf : refinement.leaves()) second.push_back({leaf, 6});
                refinement.refine(second);
            } else {
                std::vector<RefineRequest> both;
                for (Index c = 0; c < 8; ++c) both.push_back({c});
                refinement.refine(both);
            }
            Random random(seed);
            for (int round = 0; round < 5; ++round) {
                const Point p(random.uniform(0, 2), random.uniform(0, 2), random.uniform(0, 2));
                std::vector<RefineRequest> requests;
                for (Index leaf : refinement.leaves()) {
                    const RefineNode& node = refinement.node(leaf);
                    const Point low = refinement.position(node.vertices[0]),
                                high = refinement.position(node.vertices[6]);
                    if (glm::all(glm::lessThanEqual(low, p)) && glm::all(glm::lessThan(p, high)))
                        requests.push_back({leaf});
                }
                refinement.refine(requests);
            }
            std::set<std::array<double, 6>> boxes;
            for (Index leaf : refinement.leaves()) {
                const RefineNode& node = refinement.node(leaf);
                const Point low = refinement.position(node.vertices[0]),
                            high = refinement.position(node.vertices[6]);
                boxes.insert({low.x, low.y, low.z, high.x, high.y, high.z});
            }
            return boxes;
        };
        const auto uniform = refine_all(false), mixed = refine_all(true);
        REQUIRE(uniform == mixed);
    }
}

TEST_CASE("rings keep whole cells between levels") {
    const HexMesh roots = make_grid({8, 8, 8});
    for (int rings : {1, 2, 3}) {
        CellRefinement refinement = start(roots);
        const Point p(3.9, 3.9, 3.9);
        for (int round = 0; round < 3; ++round) {
            std::vector<RefineRequest> requests;
            for (Index leaf : refinement.leaves()) {
                const RefineNode& node = refinement.node(leaf);
                if (glm::all(glm::lessThanEqual(refinement.position(node.vertices[0]), p)) &&
                    glm::all(glm::lessThan(p, refinement.position(node.vertices[6]))))
                    requests.push_back({leaf});
            }
            refinement.refine(requests, rings);
        }
        require_sound(roots, refinement);
        // Distance from each cell of level k + 1 to the nearest of level k - 1, in cells of level k.
        const std::vector<Index> leaves = refinement.leaves();
        for (Index a : leaves)
            for (Index b : leaves) {
                const RefineNode &fine = refinement.node(a), &coarse = refinement.node(b);
                if (fine.depth() < coarse.depth() + 2) continue;
                const Point low_a = refinement.position(fine.vertices[0]),
                            high_a = refinement.position(fine.vertices[6]);
                const Point low_b = refinement.position(coarse.vertices[0]),
                            high_b = refinement.position(coarse.vertices[6]);
                const Point gap = glm::max(low_b - high_a, low_a - high_b);
                REQUIRE(std::max({gap.x, gap.y, gap.z}) >= rings * (high_b.x - low_b.x) / 2);
            }
    }
}

TEST_CASE("two-dimensional refinement stays one cell thick") {
    const HexMesh roots = make_grid({3, 3, 1});
    CellRefinement refinement = start(roots);
    Random random(2);
    for (int round = 0; round < 6; ++round) {
        const std::vector<Index> leaves = refinement.leaves();
        refinement.refine(std::vector<RefineRequest>{{leaves[random.below(leaves.size())], 3}});
    }
    require_sound(roots, refinement);
    require_balanced(refinement, 0);
    for (Index leaf : refinement.leaves()) REQUIRE(refinement.node(leaf).level[2] == 0);
}

TEST_CASE("leaves inherit the patches of the initial mesh") {
    HexMesh roots = make_grid({2, 1, 1});
    twist(roots, 4);
    roots.patch_names = {"low", "rest"};
    const Topology topology = compute_topology(roots);
    for (CellFace face : topology.boundary_faces) {
        const Quad quad = face_vertices(roots, face);
        const bool low =
            std::all_of(quad.begin(), quad.end(), [&](Index v) { return roots.positions[v].x == 0; });
        roots.boundary.push_back({quad, low ? 0u : 1u});
    }
    CellRefinement refinement = start(roots);
    refinement.refine(std::vector<RefineRequest>{{0}, {1, 1}});
    const HexMesh mesh = refinement.leaf_mesh(Parallel(1)).mesh;
    std::array<double, 2> area = {0, 0};
    for (const BoundaryQuad& quad : mesh.boundary) {
        const auto& x = mesh.positions;
        const Quad& q = quad.vertices;
        area[quad.patch] += glm::length(glm::cross(x[q[2]] - x[q[0]], x[q[3]] - x[q[1]])) / 2;
    }
    REQUIRE(area[0] == Approx(1));
    REQUIRE(area[1] == Approx(9));
    REQUIRE(mesh.boundary.size() == compute_topology(mesh).boundary_faces.size());
}

TEST_CASE("what cannot be refined is refused or counted") {
    HexMesh roots = make_grid({1, 1, 1});
    CellRefinement refinement = start(roots);
    const RefineCount count = refinement.refine(std::vector<RefineRequest>{{5}, {0, 0}, {0, 8}});
    REQUIRE(count.refused == 3);
    REQUIRE(refinement.leaf_count() == 1);
    REQUIRE(refinement.refine(std::vector<RefineRequest>{{0}, {0}}).requested == 1);
    REQUIRE(refinement.refine(std::vector<RefineRequest>{{0}}).refused == 1);
    Index corner = refinement.node(0).first_child;
    for (int level = 1; level < refinement.max_level(); ++level) {
        REQUIRE(refinement.refine(std::vector<RefineRequest>{{corner}}).requested == 1);
        corner = refinement.node(corner).first_child;
    }
    REQUIRE(refinement.refine(std::vector<RefineRequest>{{corner}}).refused == 1);
    require_sound(roots, refinement);

    REQUIRE_FALSE(CellRefinement::create({}, Parallel(1)).has_value());
    roots.cells[0][1] = roots.cells[0][0];
    REQUIRE_FALSE(CellRefinement::create(roots, Parallel(1)).has_value());
}

namespace {

void check_same(const LeafMesh& a, const LeafMesh& b) {
    CHECK(a.leaf_node == b.leaf_node);
    CHECK(a.mesh.positions == b.mesh.positions);
    CHECK(a.mesh.cells == b.mesh.cells);
    CHECK(a.mesh.hanging.vertex == b.mesh.hanging.vertex);
    CHECK(a.mesh.hanging.master == b.mesh.hanging.master);
    CHECK(a.mesh.patch_names == b.mesh.patch_names);
    REQUIRE(a.mesh.boundary.size() == b.mesh.boundary.size());
    for (std::size_t i = 0; i < a.mesh.boundary.size(); ++i) {
        CHECK(a.mesh.boundary[i].vertices == b.mesh.boundary[i].vertices);
        CHECK(a.mesh.boundary[i].patch == b.mesh.boundary[i].patch);
    }
}

} // namespace

TEST_CASE("a refinement is made again from its roots and splits, or taken back, and goes on the same way") {
    for (const bool mixed : {false, true}) {
        HexMesh roots = make_ball();
        for (Index f = 0; f < 6; ++f) {
            const Cell& cell = roots.cells[f + 1];
            roots.boundary.push_back({{cell[4], cell[5], cell[6], cell[7]}, f % 2});
        }
        roots.patch_names = {"even", "odd"};
        CellRefinement first = start(roots);
        const auto refine_some = [&](CellRefinement& cells, std::uint64_t seed) {
            Random choice(seed);
            const std::vector<Index> leaves = cells.leaves();
            std::vector<RefineRequest> requests;
            for (int i = 0; i < 5; ++i)
                requests.push_back({leaves[choice.below(leaves.size())],
                                    mixed ? static_cast<AxisMask>(1 + choice.below(7)) : kAllAxes});
            cells.refine(requests);
        };
        for (std::uint64_t round = 0; round < 6; ++round) {
            refine_some(first, round);
            auto second = CellRefinement::replay(first.roots(), first.splits(), Parallel(1));
            REQUIRE(second);
            CellRefinement on = first;
            refine_some(on, 100 + round);
            refine_some(*second, 100 + round);
            const LeafMesh a = on.leaf_mesh(Parallel(1));
            CHECK(a.mesh.boundary.size() > 6);
            check_same(a, second->leaf_mesh(Parallel(1)));

            CellRefinement back = first;
            const CellRefinement::Mark mark = back.mark();
            for (std::uint64_t more = 0; more < 3; ++more) refine_some(back, 200 + round + more);
            REQUIRE(back.node_count() > first.node_count());
            back.go_back(mark);
            CHECK(back.leaf_count() == first.leaf_count());
            CHECK(back.vertex_count() == first.vertex_count());
            check_same(back.leaf_mesh(Parallel(1)), first.leaf_mesh(Parallel(1)));
            refine_some(back, 100 + round);
            check_same(a, back.leaf_mesh(Parallel(1)));
        }
    }
}

TEST_CASE("a history that cannot be is refused") {
    const HexMesh roots = make_grid({2, 1, 1});
    const auto replayed = [&](std::vector<RefineRequest> splits) {
        return CellRefinement::replay(roots, splits, Parallel(1)).has_value();
    };
    CHECK(replayed({{0, 7}, {2, 7}}));
    CHECK_FALSE(replayed({{0, 7}, {0, 7}})); // no leaf any more
    CHECK_FALSE(replayed({{2, 7}, {0, 7}})); // not yet there
    CHECK_FALSE(replayed({{0, 0}}));
    CHECK_FALSE(replayed({{0, 8}}));
    std::vector<RefineRequest> deep;
    for (Index node = 0; deep.size() < 40; node = deep.size() == 1 ? 2 : node + 2) deep.push_back({node, 1});
    CHECK_FALSE(replayed(deep));
}

namespace {

/// Centres of cells, in units small enough to tell them apart, with their numbers.
std::map<std::array<long, 3>, Index> cells_by_centre(const HexMesh& mesh) {
    std::map<std::array<long, 3>, Index> at;
    for (Index c = 0; c < mesh.cell_count(); ++c) {
        Point centre(0);
        for (Index v : mesh.cells[c]) centre += mesh.positions[v];
        at[{std::lround(centre.x * 1e6), std::lround(centre.y * 1e6), std::lround(centre.z * 1e6)}] = c;
    }
    return at;
}

void name_hanging(HexMesh& mesh) {
    auto recognised = recognise_hanging(mesh, {}, Parallel(1));
    REQUIRE(recognised);
    mesh.hanging = recognised->hanging;
}

} // namespace

TEST_CASE("an initial mesh with hanging vertices is refined as the hierarchy that it came from") {
    for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
        Random random(seed);
        HexMesh roots = seed % 2 ? make_ball() : make_grid({2, 3, 2});
        if (seed > 2) twist(roots, seed);
        CellRefinement whole = start(roots);
        const auto refine_some = [&](std::size_t count) {
            const std::vector<Index> leaves = whole.leaves();
            std::vector<RefineRequest> requests;
            for (std::size_t i = 0; i < count; ++i) requests.push_back({leaves[random.below(leaves.size())]});
            return requests;
        };
        for (int round = 0; round < 3; ++round) whole.refine(refine_some(3));
        HexMesh leaves = whole.leaf_mesh(Parallel(1)).mesh;
        twist(leaves, seed + 10);
        leaves.hanging.clear();
        name_hanging(leaves);
        REQUIRE_FALSE(leaves.hanging.empty());
        CellRefinement again = start(leaves);
        REQUIRE(again.max_root_level() >= 1);
        REQUIRE(again.balance().balance == 0);
        for (int round = 0; round < 5; ++round) {
            const std::vector<RefineRequest> requests = refine_some(4);
            const LeafMesh before = again.leaf_mesh(Parallel(1)), reference = whole.leaf_mesh(Parallel(1));
            const auto mine = cells_by_centre(before.mesh);
            std::vector<RefineRequest> same;
            for (const auto& [centre, cell] : cells_by_centre(reference.mesh))
                if (std::any_of(requests.begin(), requests.end(), [&](const RefineRequest& request) {
                        return request.node == reference.leaf_node[cell];
                    }))
                    same.push_back({before.leaf_node[mine.at(centre)]});
            const int rings = 1 + round % 2;
            const RefineCount a = whole.refine(requests, rings), b = again.refine(same, rings);
            REQUIRE(a.requested == b.requested);
            REQUIRE(a.balance == b.balance);
            const HexMesh x = whole.leaf_mesh(Parallel(1)).mesh, y = again.leaf_mesh(Parallel(1)).mesh;
            REQUIRE(x.vertex_count() == y.vertex_count());
            REQUIRE(x.hanging.count() == y.hanging.count());
            const auto at_x = cells_by_centre(x), at_y = cells_by_centre(y);
            REQUIRE(at_x.size() == x.cell_count());
            for (auto i = at_x.begin(), j = at_y.begin(); i != at_x.end(); ++i, ++j)
                REQUIRE(i->first == j->first);
            require_sound(leaves, again);
        }
        const auto replayed = CellRefinement::replay(again.roots(), again.splits(), Parallel(1));
        REQUIRE(replayed);
        CHECK(replayed->leaf_mesh(Parallel(1)).mesh.positions == again.leaf_mesh(Parallel(1)).mesh.positions);
        CHECK(again.refine(std::vector<RefineRequest>{{again.leaves()[0], 3}}).refused == 1);
    }
}

namespace {

/// 2 x 2 x 2 cells of which the first `split` are cut, and the cell of the first one that touches the middle
/// is cut again by hand: without what the balance would add.
HexMesh make_unbalanced(Index split) {
    CellRefinement cells = start(make_grid({2, 2, 2}));
    for (Index root = 0; root < split; ++root) cells.refine(std::vector<RefineRequest>{{root, kAllAxes}});
    HexMesh mesh = cells.leaf_mesh(Parallel(1)).mesh;
    const auto at = cells_by_centre(mesh);
    const Index corner = at.at({6000000, 6000000, 6000000}); // sums of eight
    const Point low = mesh.positions[mesh.cells[corner][0]];
    mesh.cells.erase(mesh.cells.begin() + corner);
    std::map<std::array<double, 3>, Index> vertex_at;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        vertex_at[{mesh.positions[v].x, mesh.positions[v].y, mesh.positions[v].z}] = v;
    for (int child = 0; child < 8; ++child) {
        Cell part;
        for (int k = 0; k < 8; ++k) {
            const Point p =
                low + 0.25 * Point((child & 1) + hex::kVertexX[k], (child >> 1 & 1) + hex::kVertexY[k],
                                   (child >> 2) + hex::kVertexZ[k]);
            const auto [found, fresh] =
                vertex_at.try_emplace({p.x, p.y, p.z}, static_cast<Index>(mesh.vertex_count()));
            if (fresh) mesh.positions.push_back(p);
            part[k] = found->second;
        }
        mesh.cells.push_back(part);
    }
    mesh.level.clear();
    name_hanging(mesh);
    return mesh;
}

} // namespace

TEST_CASE("an initial mesh is balanced over its vertices, and refused where faces or edges are not") {
    for (const Index split : {1, 4, 6}) {
        const auto refused = CellRefinement::create(make_unbalanced(split), Parallel(1));
        REQUIRE_FALSE(refused);
        CHECK(refused.error().code == ErrorCode::bad_input);
        CHECK(refused.error().one_line().find("halving") != std::string::npos);
    }
    const HexMesh mesh = make_unbalanced(7); // two halvings over one vertex only
    CellRefinement cells = start(mesh);
    CHECK(cells.max_root_level() == 2);
    CHECK(cells.balance().balance == 1);
    CHECK(cells.leaf_count() == mesh.cell_count() + 7);
    require_sound(mesh, cells);
    require_balanced(cells, 1);
}

TEST_CASE("an initial mesh with cells cut in two is refused") {
    CellRefinement cells = start(make_grid({2, 1, 1}));
    cells.refine(std::vector<RefineRequest>{{0, 1 | 2}});
    HexMesh halved = cells.leaf_mesh(Parallel(1)).mesh;
    REQUIRE_FALSE(halved.hanging.empty());
    const auto refused = CellRefinement::create(halved, Parallel(1));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().one_line().find("cut into four") != std::string::npos);
}
