#include "buffer/fitted_shapes.hpp"
#include "mesh/mesh_oracles.hpp"
#include "quality/cell_quality.hpp"

#include <optional>

using namespace hexopt;
using namespace hexopt::test;

namespace {

/// Layers everywhere, though these shapes' lattices fit without.
BufferOptions everywhere() {
    BufferOptions options;
    options.enough_sj = 2;
    return options;
}

BufferOutput insert(const FittedShape& shape, const BufferOptions& options = everywhere(), int threads = 1) {
    Context context(threads);
    auto out = insert_buffers(shape.fitted, shape.domain, options, context);
    if (!out) FAIL(out.error().one_line());
    CHECK(check_sound(out->fitted) == check_sound(shape.fitted));
    for (Index v = 0; v < out->fitted.mesh.vertex_count(); ++v) {
        const Association bound = out->fitted.association[v];
        if (bound.kind == EntityKind::hanging) continue;
        CHECK(shape.domain.model.project(bound, out->fitted.mesh.positions[v]).distance < 1e-9);
    }
    CHECK(out->report.skipped.empty());
    CHECK(out->report.after.flat_quads == 0);
    CHECK(out->report.after.two_face_cells == 0);
    CHECK(out->report.after.cells == out->fitted.mesh.cell_count());
    return std::move(out).value();
}

/// Number of ridge edges of a class (0: below 135 degrees, 1: below 225, 2: more) with so many cells.
std::size_t ridge_edges(const BufferOutput& out, std::size_t kind, std::size_t cells) {
    return out.report.after.ridge_cells[kind].edges[cells];
}

std::size_t ridge_edges(const BufferOutput& out, std::size_t kind) {
    const auto& edges = out.report.after.ridge_cells[kind].edges;
    return std::accumulate(edges.begin(), edges.end(), std::size_t{0});
}

/// After the motion no cell is bad and the smallest scaled Jacobian reaches what the notes measured.
void check_motion(BufferOutput& out, const FittedShape& shape, double min_sj) {
    Context context(2);
    const OptimizeStats stats = settle(out.fitted, shape.domain, context, min_sj + 0.01);
    CHECK(stats.bad32_after == 0);
    CHECK(stats.min_sj_after > min_sj);
}

} // namespace

TEST_CASE("buffer: a cube gets one sheet a side, each leaving through its neighbours") {
    for (std::uint32_t n : {1u, 2u, 5u}) {
        const FittedShape cube = make_cube(n);
        BufferOutput out = insert(cube);
        const std::size_t m = n + 2;
        CHECK(out.fitted.mesh.cell_count() == m * m * m);
        CHECK(out.fitted.mesh.vertex_count() == (m + 1) * (m + 1) * (m + 1));
        CHECK(out.fitted.mesh.boundary.size() == 6 * m * m);
        CHECK(out.fitted.ridges.size() == 12 * m);
        CHECK(ridge_edges(out, 0, 1) == 12 * m);
        CHECK(out.report.groups == 6);
        CHECK(out.report.passes == 3);
        CHECK(out.report.pillows + out.report.collars == 0);
        CHECK(volume_of_cells(out.fitted.mesh) == Approx(n * n * n));
        check_motion(out, cube, 0.9);
    }
}

TEST_CASE("buffer: where a lattice fits there are no layers, round a flaw there are") {
    FittedShape prism = make_l_prism(3);
    const BufferOutput left = insert(prism, {});
    CHECK(left.report.spared == 7);
    CHECK(left.report.groups + left.report.pillows + left.report.collars == 0);
    CHECK(left.fitted.mesh.cells == prism.fitted.mesh.cells);
    CHECK(left.fitted.mesh.positions == prism.fitted.mesh.positions);
    CHECK(ridge_edges(left, 2, 3) == ridge_edges(left, 2));
    CHECK(left.report.spared_quads == left.report.after.surface_quads);
    CHECK(insert(prism, everywhere()).report.spared_quads == 0);

    // Cells at one end of the concave ridge crushed: its two walls and the side that they meet get layers.
    const auto& ridge =
        *std::find_if(prism.fitted.ridges.begin(), prism.fitted.ridges.end(), [&](const auto& r) {
            return prism.domain.angle[r.curve].largest > 225 &&
                   prism.fitted.association[r.a].kind == EntityKind::corner;
        });
    const Point at = prism.fitted.mesh.positions[ridge.a];
    for (Index v = 0; v < prism.fitted.mesh.vertex_count(); ++v) {
        Point& x = prism.fitted.mesh.positions[v];
        if (prism.fitted.association[v].kind == EntityKind::interior && glm::distance(x, at) < 1.8)
            x = at + 0.05 * (x - at);
    }
    const BufferOutput flawed = insert(prism, {});
    CHECK(flawed.report.spared > 0);
    CHECK(flawed.report.groups > 0);
    CHECK(flawed.report.spared + flawed.report.groups == 7);
    CHECK(flawed.report.spared_quads > 0);
    CHECK(flawed.report.spared_quads < flawed.report.before.surface_quads);
}

TEST_CASE("buffer: the thesis's way pillows the whole surface, then every patch") {
    const std::size_t n = 4;
    const FittedShape cube = make_cube(n);
    BufferOptions options = everywhere();
    options.method = BufferMethod::thesis;
    options.collars = false;
    const BufferOutput pillow = insert(cube, options);
    CHECK(pillow.fitted.mesh.cell_count() == n * n * n + 6 * n * n);
    CHECK(ridge_edges(pillow, 0, 2) == 12 * n);
    options.collars = true;
    const BufferOutput both = insert(cube, options);
    CHECK(both.report.collars == 6);
    CHECK(both.report.groups == 1);
    CHECK(both.fitted.mesh.cell_count() > pillow.fitted.mesh.cell_count() + 6 * n * n);
    CHECK(volume_of_cells(both.fitted.mesh) == Approx(n * n * n));
}

TEST_CASE("buffer: a concave ridge gets two cells from its group and four with pillows") {
    const FittedShape prism = make_l_prism(3);
    BufferOptions options = everywhere();
    options.pillow_deg = 361;
    const BufferOutput group = insert(prism, options);
    CHECK(group.report.groups == 7);
    CHECK(ridge_edges(group, 2, 2) == ridge_edges(group, 2));
    CHECK(ridge_edges(group, 0, 1) == ridge_edges(group, 0));
    CHECK(ridge_edges(group, 2) == 6 + 2);
    BufferOutput pillowed = insert(prism);
    CHECK(pillowed.report.pillows == 2);
    CHECK(ridge_edges(pillowed, 2, 4) == ridge_edges(pillowed, 2));
    CHECK(volume_of_cells(pillowed.fitted.mesh) == Approx(6 * 6 * 6 * 0.75));
    check_motion(pillowed, prism, 0.27);
}

TEST_CASE("buffer: walls round a foot join into one pillow, the floor is another") {
    const FittedShape slab = make_box_on_slab(3);
    BufferOutput out = insert(slab);
    CHECK(out.report.pillows == 2);
    CHECK(ridge_edges(out, 2, 4) == ridge_edges(out, 2));
    CHECK(ridge_edges(out, 2) == 4 * 3);
    CHECK(volume_of_cells(out.fitted.mesh) == Approx(9 * 9 * 3 + 27));
    check_motion(out, slab, 0.22);
}

TEST_CASE("buffer: outside of a cube, and three concave ridges that meet") {
    const FittedShape hollow = make_hollow_cube(3);
    BufferOutput out = insert(hollow);
    CHECK(ridge_edges(out, 2, 4) == 12 * 3);
    CHECK(ridge_edges(out, 0, 1) == ridge_edges(out, 0));
    check_motion(out, hollow, 0.18);
    const FittedShape notched = make_notched_cube(3);
    BufferOutput corner = insert(notched);
    CHECK(ridge_edges(corner, 2, 4) == ridge_edges(corner, 2));
    check_motion(corner, notched, 0.26);
}

TEST_CASE("buffer: a fin on a plate: each of its sides gets a pillow of its own at the foot") {
    BoxShape shape{{13, 10, 12}};
    shape.inside = [](Point p) {
        const bool in_plate = p.x > 3 && p.x < 10 && p.y > 2 && p.y < 8 && p.z > 3 && p.z < 5;
        const bool in_fin = p.x > 5 && p.x < 8 && p.y > 4 && p.y < 6 && p.z > 3 && p.z < 8;
        return !in_plate && !in_fin;
    };
    const FittedShape fin = fit_to_itself(make_mesh(shape));
    BufferOutput out = insert(fin);
    CHECK(ridge_edges(out, 2, 4) == ridge_edges(out, 2));
    check_motion(out, fin, 0.2);
}

namespace {

/// Whether the cells at a vertex are joined over faces, and what is not there too.
bool is_manifold(const std::array<std::array<std::array<bool, 2>, 2>, 2>& cell) {
    int pieces = 0;
    std::array<bool, 8> seen{};
    for (int start = 0; start < 8; ++start) {
        if (seen[start]) continue;
        ++pieces;
        std::vector<int> open = {start};
        seen[start] = true;
        while (!open.empty()) {
            const int c = open.back();
            open.pop_back();
            for (int bit : {1, 2, 4}) {
                const int d = c ^ bit;
                if (seen[d] || cell[c & 1][c >> 1 & 1][c >> 2] != cell[d & 1][d >> 1 & 1][d >> 2]) continue;
                seen[d] = true;
                open.push_back(d);
            }
        }
    }
    return pieces == 2;
}

/// A block with some boxes of three cells or more taken out of it, or these boxes alone; nothing where the
/// surface touches itself.
std::optional<HexMesh> make_random_boxes(std::uint64_t seed) {
    Random random(seed);
    constexpr std::uint32_t kSide = 4, kCells = 3;
    const bool hollow = random.below(2) == 0;
    std::vector<std::array<std::uint32_t, 6>> boxes(1 + random.below(4));
    for (auto& box : boxes)
        for (int k = 0; k < 3; ++k) {
            box[k] = static_cast<std::uint32_t>(random.below(kSide - 1)) + (hollow ? 1 : 0);
            box[k + 3] = box[k] + 1 + static_cast<std::uint32_t>(random.below(kSide - 1));
            if (hollow) box[k] = std::min(box[k], kSide - 2), box[k + 3] = std::min(box[k + 3], kSide - 1);
        }
    const auto has = [&](std::array<double, 3> p) {
        const bool in_box = std::any_of(boxes.begin(), boxes.end(), [&](const auto& box) {
            return p[0] > box[0] && p[0] < box[3] && p[1] > box[1] && p[1] < box[4] && p[2] > box[2] &&
                   p[2] < box[5];
        });
        const bool in_block =
            *std::min_element(p.begin(), p.end()) > 0 && *std::max_element(p.begin(), p.end()) < kSide;
        return in_block && in_box != hollow;
    };
    for (std::uint32_t corner = 0; corner < (kSide + 1) * (kSide + 1) * (kSide + 1); ++corner) {
        std::array<std::array<std::array<bool, 2>, 2>, 2> cell{};
        int kept = 0;
        for (int i = 0; i < 8; ++i) {
            cell[i & 1][i >> 1 & 1][i >> 2] = has({corner % (kSide + 1) + (i & 1) - 0.5,
                                                   corner / (kSide + 1) % (kSide + 1) + (i >> 1 & 1) - 0.5,
                                                   corner / ((kSide + 1) * (kSide + 1)) + (i >> 2) - 0.5});
            kept += cell[i & 1][i >> 1 & 1][i >> 2];
        }
        if (kept > 0 && kept < 8 && !is_manifold(cell)) return std::nullopt;
    }
    BoxShape shape{{kSide * kCells, kSide * kCells, kSide * kCells}};
    shape.inside = [&](Point p) { return has({p.x / kCells, p.y / kCells, p.z / kCells}); };
    return make_mesh(shape);
}

} // namespace

TEST_CASE("buffer: random bodies of boxes and blocks with such hollows stay sound and lose every flat quad") {
    int tried = 0;
    for (std::uint64_t seed = 1; tried < 15; ++seed) {
        INFO("seed " << seed);
        const std::optional<HexMesh> mesh = make_random_boxes(seed);
        if (!mesh) continue;
        ++tried;
        const BufferOutput out = insert(fit_to_itself(*mesh));
        CHECK(ridge_edges(out, 2, 1) + ridge_edges(out, 2, 2) == 0);
    }
}

TEST_CASE("buffer: flat quads on a cylinder's rims go, with levels across the wall too") {
    const auto levels = GENERATE(0, 1, 2);
    const auto refine = [levels](Point p) { return levels == 1 ? p.x + p.y > 9 : p.z > 3.2; };
    const FittedShape cylinder = make_cylinder(6, levels > 0 ? 1 : 0, refine);
    Context context(1);
    BufferOutput out = insert(cylinder);
    CHECK(out.report.before.flat_quads > 0);
    CHECK(out.report.before.two_face_cells > 0);
    CHECK(out.report.groups == 3);
    CHECK(out.report.collars == 0);
    check_motion(out, cylinder, 0.5);
}

TEST_CASE("buffer: neighbours of other patches without a ridge stay one group") {
    FittedShape cube = make_cube(4);
    const Index lost = cube.fitted.ridges[0].curve;
    const Index patch = cube.domain.curve_patch[lost][0];
    std::erase_if(cube.fitted.ridges, [&](const auto& ridge) { return ridge.curve == lost; });
    for (Association& a : cube.fitted.association)
        if (a == Association{EntityKind::curve, lost}) a = {EntityKind::patch, patch};
    Context context(1);
    auto out = insert_buffers(cube.fitted, cube.domain, everywhere(), context);
    REQUIRE(out);
    CHECK(check_sound(out->fitted) == 2);
    CHECK(out->report.groups == 5);
    for (const FittedMesh::RidgeEdge& ridge : out->fitted.ridges) CHECK(ridge.curve != lost);
}

TEST_CASE("buffer: the sides of a ridge that ends inside a patch are told apart") {
    FittedShape prism = make_l_prism(4);
    Index concave = 0;
    while (prism.domain.angle[concave].largest < 200) ++concave;
    // The upper half of the concave ridge fades out: its end becomes a corner, the rest part of a patch.
    const double end = 4;
    const Index patch = prism.domain.curve_patch[concave][0];
    FittedMesh& fitted = prism.fitted;
    std::erase_if(fitted.ridges, [&](const FittedMesh::RidgeEdge& ridge) {
        return ridge.curve == concave &&
               std::max(fitted.mesh.positions[ridge.a].z, fitted.mesh.positions[ridge.b].z) > end + 0.5;
    });
    for (Index v = 0; v < fitted.mesh.vertex_count(); ++v)
        if (fitted.association[v] == Association{EntityKind::curve, concave} &&
            fitted.mesh.positions[v].z > end + 0.5)
            fitted.association[v] = {EntityKind::patch, patch};
    const BufferOutput out = insert(prism);
    CHECK(out.report.pillows == 2);
    CHECK(ridge_edges(out, 2, 4) == ridge_edges(out, 2));
    CHECK(ridge_edges(out, 2) >= 4);
}

TEST_CASE("buffer: pillows end some quads from their ridges, on the surface") {
    const FittedShape prism = make_l_prism(8);
    BufferOptions options = everywhere();
    options.reach_quads = 100;
    const std::size_t whole = insert(prism, options).fitted.mesh.cell_count();
    options.reach_quads = 3;
    BufferOutput out = insert(prism, options);
    CHECK(out.fitted.mesh.cell_count() < 0.95 * static_cast<double>(whole));
    CHECK(ridge_edges(out, 2, 4) == ridge_edges(out, 2));
    check_motion(out, prism, 0.3);
}

namespace {

/// Corners of faces inside the mesh whose two sides lie in one smooth patch: one of the two cells there is
/// squeezed between the face and the surface.
std::size_t count_squeezed_corners(const FittedMesh& fitted) {
    std::map<std::array<Index, 2>, std::set<Index>> patches;
    std::set<Quad> on_surface;
    const auto edge = [](Index a, Index b) { return std::array{std::min(a, b), std::max(a, b)}; };
    for (const BoundaryQuad& quad : fitted.mesh.boundary) {
        Quad key = quad.vertices;
        std::sort(key.begin(), key.end());
        on_surface.insert(key);
        for (int s = 0; s < 4; ++s)
            patches[edge(quad.vertices[s], quad.vertices[(s + 1) % 4])].insert(quad.patch);
    }
    std::size_t count = 0;
    for (const Cell& cell : fitted.mesh.cells)
        for (const auto& face : hex::kFaceVertex) {
            const Quad q = {cell[face[0]], cell[face[1]], cell[face[2]], cell[face[3]]};
            Quad key = q;
            std::sort(key.begin(), key.end());
            if (on_surface.count(key) > 0) continue;
            for (int s = 0; s < 4; ++s) {
                const auto one = patches.find(edge(q[(s + 3) % 4], q[s]));
                const auto two = patches.find(edge(q[s], q[(s + 1) % 4]));
                if (one == patches.end() || two == patches.end()) continue;
                if (one->second.size() == 1 && one->second == two->second) ++count;
            }
        }
    return count;
}

} // namespace

TEST_CASE("buffer: no face inside the mesh comes to lie in a smooth patch where pillows end") {
    constexpr std::uint32_t kHalf = 6;
    FittedShape prism = make_l_prism(kHalf);
    FittedMesh& fitted = prism.fitted;
    // One corner far from the concave ridge becomes a bend of a curve, which needs a collar.
    const auto vertex_at = [&](Point p) {
        for (Index v = 0;; ++v)
            if (glm::distance(fitted.mesh.positions[v], p) < 1e-9) return v;
    };
    const Index corner = vertex_at({kHalf, 2 * kHalf, 0}), beside = vertex_at({kHalf, 2 * kHalf - 1, 0}),
                above = vertex_at({kHalf, 2 * kHalf, 1});
    const auto ridge_of = [&](Index a, Index b) {
        return std::find_if(fitted.ridges.begin(), fitted.ridges.end(), [&](const FittedMesh::RidgeEdge& r) {
            return r.a == std::min(a, b) && r.b == std::max(a, b);
        });
    };
    const Index curve = ridge_of(corner, above)->curve;
    ridge_of(corner, beside)->curve = curve;
    fitted.association[corner] = {EntityKind::curve, curve};
    for (int reach : {3, 4, 5}) {
        BufferOptions options = everywhere();
        options.reach_quads = reach;
        Context context(1);
        const auto out = insert_buffers(fitted, prism.domain, options, context);
        REQUIRE(out);
        CHECK(check_sound(out->fitted) == check_sound(fitted));
        CHECK(out->report.collars > 0);
        CHECK(count_squeezed_corners(out->fitted) == 0);
    }
}

TEST_CASE("buffer: the same mesh for any number of threads") {
    const FittedShape slab = make_box_on_slab(3);
    const BufferOutput first = insert(slab, {}, 1);
    for (int threads : {2, 3}) {
        const BufferOutput other = insert(slab, {}, threads);
        CHECK(other.fitted.mesh.positions == first.fitted.mesh.positions);
        CHECK(other.fitted.mesh.cells == first.fitted.mesh.cells);
        CHECK(other.fitted.association == first.fitted.association);
        CHECK(other.fitted.ridges == first.fitted.ridges);
    }
}

TEST_CASE("buffer: what does not fit is refused") {
    const FittedShape cube = make_cube(2);
    Context context(1);
    const auto code = [&](const FittedMesh& fitted, const BufferOptions& options = {}) {
        auto out = insert_buffers(fitted, cube.domain, options, context);
        return out ? ErrorCode::ok : out.error().code;
    };
    SECTION("associations") {
        FittedMesh fitted = cube.fitted;
        fitted.association.pop_back();
        CHECK(code(fitted) == ErrorCode::bad_input);
        fitted = cube.fitted;
        fitted.association[0] = {EntityKind::curve, 99};
        CHECK(code(fitted) == ErrorCode::bad_input);
    }
    SECTION("ridges") {
        FittedMesh fitted = cube.fitted;
        fitted.ridges[0].curve = 99;
        CHECK(code(fitted) == ErrorCode::bad_input);
        fitted = cube.fitted;
        std::swap(fitted.ridges.front(), fitted.ridges.back());
        CHECK(code(fitted) == ErrorCode::bad_input);
    }
    SECTION("patches") {
        FittedMesh fitted = cube.fitted;
        fitted.mesh.boundary[3].patch = 17;
        CHECK(code(fitted) == ErrorCode::bad_input);
    }
    SECTION("options") {
        BufferOptions options = everywhere();
        options.join_deg = -1;
        CHECK(code(cube.fitted, options) == ErrorCode::usage);
        options = {};
        options.band_quads = 0;
        CHECK(code(cube.fitted, options) == ErrorCode::usage);
        options = {};
        options.join_deg = std::numeric_limits<double>::quiet_NaN();
        CHECK(code(cube.fitted, options) == ErrorCode::usage);
    }
    SECTION("a cancelled run") {
        context.cancel();
        CHECK(code(cube.fitted) == ErrorCode::cancelled);
    }
}

TEST_CASE("buffer: spreading the layers makes no cell worse than it needs to") {
    const FittedShape cylinder = make_cylinder(8);
    BufferOptions options = everywhere();
    options.relax_sweeps = 0;
    const BufferOutput squeezed = insert(cylinder, options);
    const BufferOutput spread = insert(cylinder);
    const auto worst = [](const HexMesh& mesh) {
        double least = 1;
        for (const Cell& cell : mesh.cells) {
            HexPoints points;
            for (int k = 0; k < 8; ++k) points[k] = mesh.positions[cell[k]];
            least = std::min(least, scaled_jacobian(points));
        }
        return least;
    };
    const double before = worst(squeezed.fitted.mesh), after = worst(spread.fitted.mesh);
    CHECK(after >= std::min(before, 0.3));
    CHECK(spread.fitted.mesh.cells == squeezed.fitted.mesh.cells);
    CHECK(spread.fitted.mesh.positions != squeezed.fitted.mesh.positions);
}
