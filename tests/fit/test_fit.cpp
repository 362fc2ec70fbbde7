#include "core/union_find.hpp"
#include "mesh/hex_reference.hpp"
#include "mesh/topology.hpp"
#include "samples/box_mesh.hpp"
#include "samples/grid.hpp"
#include "stages/fit/capture.hpp"
#include "stages/fit/curve_net.hpp"
#include "stages/fit/curve_sides.hpp"
#include "stages/fit/fairing.hpp"
#include "stages/fit/fit.hpp"
#include "stages/fit/regions.hpp"
#include "stages/fit/surface_mesh.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <span>

using namespace hexopt;

namespace {

/// Box [0, size] as twelve triangles, one patch.
TriangleSoup make_box(const Point& size) {
    TriangleSoup soup;
    for (int v = 0; v < 8; ++v)
        soup.vertices.push_back(size * Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]));
    for (const auto& f : hex::kFaceVertex) {
        soup.triangles.push_back({f[0], f[1], f[2]});
        soup.triangles.push_back({f[0], f[2], f[3]});
    }
    return soup;
}

/// Occupied cells of a grid of n cells a side.
class Grid {
  public:
    explicit Grid(int n) : n_(n), full_(static_cast<std::size_t>(n * n * n), 0) {}
    std::uint8_t& at(int i, int j, int k) { return full_[static_cast<std::size_t>((k * n_ + j) * n_ + i)]; }
    int size() const { return n_; }

    /// Takes cells away until those round each vertex hang together by faces, and the empty ones too.
    void make_manifold() {
        for (bool changed = true; changed;) {
            changed = false;
            for (int k = 1; k < n_; ++k)
                for (int j = 1; j < n_; ++j)
                    for (int i = 1; i < n_; ++i) changed |= repair(i, j, k);
        }
    }

  private:
    static bool connected(unsigned mask) {
        unsigned reached = mask & (~mask + 1);
        for (int round = 0; round < 8; ++round)
            for (unsigned c = 0; c < 8; ++c)
                for (unsigned bit = 1; bit < 8; bit <<= 1)
                    if (reached >> c & 1 && mask >> (c ^ bit) & 1) reached |= 1u << (c ^ bit);
        return reached == mask;
    }
    bool repair(int i, int j, int k) {
        const auto cell = [&](int c) -> std::uint8_t& {
            return at(i - 1 + (c & 1), j - 1 + (c >> 1 & 1), k - 1 + (c >> 2));
        };
        unsigned mask = 0;
        for (int c = 0; c < 8; ++c) mask |= static_cast<unsigned>(cell(c)) << c;
        if (connected(mask) && connected(255 & ~mask)) return false;
        for (int c = 0; c < 8; ++c)
            if (mask >> c & 1) {
                cell(c) = 0;
                return true;
            }
        return false;
    }

    int n_;
    std::vector<std::uint8_t> full_;
};

/// A staircase of cells of size h on an n-cell grid from -1.5: those whose centre, turned back, is inside.
template <class Inside>
HexMesh make_staircase_of(const Inside& inside, const glm::dmat3& turn, int n, double h) {
    const double low = -1.5;
    Grid grid(n);
    const auto each = [&](const auto& visit) {
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) visit(i, j, k);
    };
    each([&](int i, int j, int k) {
        grid.at(i, j, k) = inside(glm::transpose(turn) * (Point(low) + h * Point(i + .5, j + .5, k + .5)));
    });
    grid.make_manifold();
    HexMesh mesh;
    std::map<std::array<int, 3>, Index> vertex;
    each([&](int i, int j, int k) {
        if (!grid.at(i, j, k)) return;
        Cell cell;
        for (int v = 0; v < 8; ++v) {
            const std::array<int, 3> at = {i + hex::kVertexX[v], j + hex::kVertexY[v], k + hex::kVertexZ[v]};
            const auto [entry, fresh] = vertex.try_emplace(at, static_cast<Index>(mesh.vertex_count()));
            if (fresh) mesh.positions.push_back(Point(low) + h * Point(at[0], at[1], at[2]));
            cell[v] = entry->second;
        }
        mesh.cells.push_back(cell);
    });
    mesh.revision = 1;
    return mesh;
}

/// The same for a box, of cells deeper inside than a tenth of their size.
HexMesh make_staircase(const Point& size, const glm::dmat3& turn, int n, double h) {
    const auto inside = [&](const Point& x) {
        for (int a = 0; a < 3; ++a)
            if (x[a] <= 0.1 * h || x[a] >= size[a] - 0.1 * h) return false;
        return true;
    };
    return make_staircase_of(inside, turn, n, h);
}

glm::dmat3 rotation(double a, double b) {
    const glm::dmat3 z(std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a), 0, 0, 0, 1);
    const glm::dmat3 x(1, 0, 0, 0, std::cos(b), std::sin(b), 0, -std::sin(b), std::cos(b));
    return x * z;
}

TriangleSoup turned(TriangleSoup soup, const glm::dmat3& turn) {
    for (Point& p : soup.vertices) p = turn * p;
    return soup;
}

/// A regular icosahedron of radius 1, whose edges all are features.
TriangleSoup make_icosahedron() {
    const double g = 0.5 * (1 + std::sqrt(5.0)), r = 1 / std::sqrt(1 + g * g);
    TriangleSoup soup;
    for (double x : {-1.0, 1.0})
        for (double y : {-g, g})
            for (int axis = 0; axis < 3; ++axis) {
                Point p(0);
                p[(axis + 1) % 3] = r * x;
                p[(axis + 2) % 3] = r * y;
                soup.vertices.push_back(p);
            }
    const auto are_joined = [&](Index i, Index j) {
        return glm::distance(soup.vertices[i], soup.vertices[j]) < 2.1 * r;
    };
    for (Index i = 0; i < 12; ++i)
        for (Index j = i + 1; j < 12; ++j)
            for (Index k = j + 1; k < 12; ++k) {
                if (!are_joined(i, j) || !are_joined(j, k) || !are_joined(i, k)) continue;
                const Point &a = soup.vertices[i], &b = soup.vertices[j], &c = soup.vertices[k];
                const bool outwards = glm::dot(glm::cross(b - a, c - a), a) > 0;
                soup.triangles.push_back({i, outwards ? j : k, outwards ? k : j});
            }
    return soup;
}

/// Each triangle cut into four, its vertices at random distances from 1 - amount to 1 + amount.
TriangleSoup roughen(const TriangleSoup& soup, double amount, unsigned seed) {
    TriangleSoup fine;
    std::map<std::pair<Index, Index>, Index> middle;
    fine.vertices = soup.vertices;
    const auto middle_of = [&](Index a, Index b) {
        const auto [at, fresh] = middle.try_emplace(std::minmax(a, b), Index(fine.vertices.size()));
        if (fresh) fine.vertices.push_back(0.5 * (soup.vertices[a] + soup.vertices[b]));
        return at->second;
    };
    for (const auto& [a, b, c] : soup.triangles) {
        const Index ab = middle_of(a, b), bc = middle_of(b, c), ca = middle_of(c, a);
        for (const auto& t : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
            fine.triangles.push_back(t);
    }
    std::mt19937 random(seed);
    for (Point& p : fine.vertices)
        p = glm::normalize(p) * std::uniform_real_distribution(1 - amount, 1 + amount)(random);
    return fine;
}

} // namespace

TEST_CASE("fit: corners and edges of turned boxes are captured exactly") {
    Context context(1);
    const Point size(1.1, 0.9, 0.8);
    for (int trial = 0; trial < 8; ++trial) {
        const glm::dmat3 turn = rotation(0.1 + 0.17 * trial, 0.05 + 0.11 * trial);
        CAPTURE(trial);
        auto domain = build_domain(turned(make_box(size), turn), {}, context);
        REQUIRE(domain);
        REQUIRE(domain->model.corner_count() == 8);
        REQUIRE(domain->model.curve_count() == 12);
        auto fitted = fit_boundary(make_staircase(size, turn, 45, 0.075), *domain, {}, context);
        REQUIRE(fitted);
        CHECK(fitted->report.captured_corners == 8);
        CHECK(fitted->report.captured_curves == 12);
        CHECK(fitted->refine_cells.empty());

        const FittedMesh& result = fitted->fitted;
        std::set<Index> corners, patches;
        for (Index v = 0; v < result.mesh.vertex_count(); ++v) {
            const Association& bound = result.association[v];
            const Projection at = domain->model.project(bound, result.mesh.positions[v]);
            CHECK(at.distance < 1e-12);
            if (bound.kind == EntityKind::corner) corners.insert(bound.entity);
        }
        CHECK(corners.size() == 8);
        for (const BoundaryQuad& quad : result.mesh.boundary) patches.insert(quad.patch);
        CHECK(patches.size() == 6);
        // Every ridge has its curve's two patches beside it.
        std::map<std::array<Index, 2>, std::set<Index>> beside;
        for (const BoundaryQuad& quad : result.mesh.boundary)
            for (int k = 0; k < 4; ++k) {
                const auto [a, b] = std::minmax(quad.vertices[k], quad.vertices[(k + 1) % 4]);
                beside[{a, b}].insert(quad.patch);
            }
        for (const auto& ridge : result.ridges) {
            const auto own = domain->curve_patch[ridge.curve];
            CHECK(beside.at({ridge.a, ridge.b}) == std::set<Index>(own.begin(), own.end()));
            beside.erase({ridge.a, ridge.b});
        }
        for (const auto& [edge, patch] : beside) CHECK(patch.size() == 1);
    }
}

TEST_CASE("fit: the same bits for any number of threads") {
    const Point size(1.1, 0.9, 0.8);
    const glm::dmat3 turn = rotation(0.4, 0.3);
    std::vector<Point> first;
    for (int threads : {1, 2, 4}) {
        Context context(threads);
        auto domain = build_domain(turned(make_box(size), turn), {}, context);
        REQUIRE(domain);
        auto fitted = fit_boundary(make_staircase(size, turn, 30, 0.11), *domain, {}, context);
        REQUIRE(fitted);
        if (first.empty()) first = fitted->fitted.mesh.positions;
        CHECK(first == fitted->fitted.mesh.positions);
    }
}

TEST_CASE("fit: curves closer together than the cells are released and named for refinement") {
    Context context(1);
    const Point size(1.1, 0.9, 0.06);
    auto domain = build_domain(make_box(size), {}, context);
    REQUIRE(domain);
    HexMesh coarse = make_staircase(Point(1.1, 0.9, 0.3), glm::dmat3(1), 30, 0.11);
    auto fitted = fit_boundary(std::move(coarse), *domain, {}, context);
    REQUIRE(fitted);
    CHECK(fitted->report.captured_curves + fitted->report.released_curves.size() == 12);
    if (!fitted->report.released_curves.empty()) CHECK(!fitted->refine_cells.empty());
    // What is not enclosed by captured curves is not pulled onto one patch.
    for (const BoundaryQuad& quad : fitted->fitted.mesh.boundary) {
        Point centre(0);
        for (Index v : quad.vertices) centre += 0.25 * fitted->fitted.mesh.positions[v];
        CHECK(domain->model.project_patch(quad.patch, centre).distance < 0.11);
    }
}

namespace {

/// Ridges lie on their curve and have its two patches beside them.
void check_ridges(const FittedMesh& result, const Domain& domain) {
    std::map<std::array<Index, 2>, std::set<Index>> beside;
    for (const BoundaryQuad& quad : result.mesh.boundary)
        for (int k = 0; k < 4; ++k) {
            const auto [a, b] = std::minmax(quad.vertices[k], quad.vertices[(k + 1) % 4]);
            beside[{a, b}].insert(quad.patch);
        }
    for (const auto& ridge : result.ridges) {
        const auto own = domain.curve_patch[ridge.curve];
        CHECK(beside.at({ridge.a, ridge.b}) == std::set<Index>(own.begin(), own.end()));
        for (Index v : {ridge.a, ridge.b})
            if (result.association[v].kind == EntityKind::curve)
                CHECK(domain.model.project_curve(ridge.curve, result.mesh.positions[v]).distance < 1e-12);
    }
}

/// No one to four quads lie in the middle of another patch, without an edge that follows a curve; nor, where
/// `whole`, more of them that are not the largest piece of their patch in what ridges enclose.
void check_islands(const FittedMesh& result, bool whole = false) {
    const std::vector<BoundaryQuad>& quads = result.mesh.boundary;
    std::map<std::array<Index, 2>, std::vector<Index>> beside;
    for (Index q = 0; q < quads.size(); ++q)
        for (int k = 0; k < 4; ++k) {
            const auto [a, b] = std::minmax(quads[q].vertices[k], quads[q].vertices[(k + 1) % 4]);
            beside[{a, b}].push_back(q);
        }
    std::set<std::array<Index, 2>> ridges;
    for (const auto& ridge : result.ridges) ridges.insert({ridge.a, ridge.b});
    UnionFind parts(quads.size()), regions(quads.size());
    std::vector<std::uint8_t> has_ridge(quads.size(), 0);
    for (const auto& [edge, own] : beside)
        if (own.size() == 2 && !ridges.contains(edge)) {
            regions.join(own[0], own[1]);
            if (quads[own[0]].patch == quads[own[1]].patch) parts.join(own[0], own[1]);
        }
    std::map<Index, std::size_t> size;
    for (Index q = 0; q < quads.size(); ++q) ++size[parts.find(q)];
    for (const auto& [edge, own] : beside)
        if (ridges.contains(edge))
            for (Index q : own) has_ridge[parts.find(q)] = 1;
    std::map<std::array<Index, 2>, std::size_t> largest;
    std::map<Index, std::size_t> region_size;
    for (const auto& [part, count] : size) {
        region_size[regions.find(part)] += count;
        std::size_t& most = largest[{regions.find(part), quads[part].patch}];
        most = std::max(most, count);
    }
    for (const auto& [part, count] : size) {
        const bool is_rest = count < largest[{regions.find(part), quads[part].patch}];
        const bool is_crumb = whole && region_size[regions.find(part)] < 24; // a cell or two on their own
        CHECK((has_ridge[part] || is_crumb || (count > 4 && !(whole && is_rest))));
    }
}

/// Box [0, size] whose corner at `size` is cut off by a triangle with legs of length `cut`.
TriangleSoup make_cut_box(const Point& size, double cut) {
    TriangleSoup soup = make_box(size);
    soup.triangles.clear();
    constexpr Index kCorner = 6;        // of the reference hexahedron: (1, 1, 1)
    const auto towards = [&](Index v) { // the cut's vertex on the edge from the corner to v
        const Point d = soup.vertices[kCorner] - soup.vertices[v];
        return static_cast<Index>(8 + (d.x > 0 ? 0 : d.y > 0 ? 1 : 2));
    };
    for (int k = 0; k < 3; ++k) {
        soup.vertices.push_back(size);
        soup.vertices.back()[k] -= cut;
    }
    for (const auto& f : hex::kFaceVertex) {
        const auto at = static_cast<std::size_t>(std::find(f.begin(), f.end(), kCorner) - f.begin());
        std::vector<Index> loop; // from the vertex opposite the corner on, if the corner is there
        for (std::size_t k = 0; k < 4; ++k) {
            const Index v = f[(at + 2 + k) % 4];
            if (v != kCorner) {
                loop.push_back(v);
                continue;
            }
            loop.push_back(towards(f[(at + 3) % 4]));
            loop.push_back(towards(f[(at + 1) % 4]));
        }
        for (std::size_t k = 1; k + 1 < loop.size(); ++k)
            soup.triangles.push_back({loop[0], loop[k], loop[k + 1]});
    }
    soup.triangles.push_back({8, 9, 10});
    return soup;
}

} // namespace

TEST_CASE("fit: the patch left of a leg is the one that lies there seen from outside") {
    Context context(1);
    const auto domain = build_domain(turned(make_box(Point(1.1, 0.9, 0.8)), rotation(0.4, 0.3)), {}, context);
    REQUIRE(domain);
    const BoundaryModel& model = domain->model;
    std::vector<double> sizes(model.corner_count(), 0.01);
    const fit::CurveNet net = fit::make_curve_net(*domain, fit::find_small_features(*domain, sizes));
    const std::vector<Index> left = fit::find_left_patches(*domain, net);
    REQUIRE(left.size() == 12);
    const auto centre_of = [&](Index patch) {
        const auto [first, last] = model.patch_triangles(patch);
        Point sum(0);
        for (Index t = first; t < last; ++t)
            for (const Point& corner : model.triangle(t)) sum += corner;
        return sum / (3.0 * (last - first));
    };
    const Point body = [&] {
        Point sum(0);
        for (Index p = 0; p < 6; ++p) sum += centre_of(p) / 6.0;
        return sum;
    }();
    for (Index l = 0; l < 12; ++l) {
        REQUIRE(left[l] != kNoIndex);
        const std::vector<Point>& points = net.legs[l].points;
        const Point along = points.back() - points.front(), out = points.front() - body;
        const Point side = centre_of(left[l]) - 0.5 * (points.front() + points.back());
        // Seen from outside, with the leg running up, what lies left turns anticlockwise from it.
        CHECK(glm::dot(glm::cross(along, side), out) > 0);
    }
}

TEST_CASE("fit: curves have their own patches beside them where others are released") {
    // Flat boxes, in cells that are too large for their sides: regions hold several patches.
    Context context(1);
    for (int trial = 0; trial < 40; ++trial) {
        CAPTURE(trial);
        const Point size(1.1, 0.9, 0.10 + 0.004 * trial);
        const glm::dmat3 turn = rotation(0.1 + 0.31 * trial, 0.05 + 0.23 * trial);
        auto domain = build_domain(turned(make_box(size), turn), {}, context);
        REQUIRE(domain);
        auto fitted = fit_boundary(make_staircase(size, turn, 35, 0.1), *domain, {}, context);
        REQUIRE(fitted);
        check_ridges(fitted->fitted, *domain);
        check_islands(fitted->fitted);
    }
}

TEST_CASE("fit: quads of a plate thinner than cells lie on the side of it that those round them lie on") {
    Context context(1);
    for (double thickness : {0.08, 0.1}) {
        for (int trial = 0; trial < 40; ++trial) {
            CAPTURE(trial);
            const Point size(1.1, 0.9, thickness);
            const glm::dmat3 turn = rotation(0.1 + 0.31 * trial, 0.05 + 0.23 * trial);
            auto domain = build_domain(turned(make_box(size), turn), {}, context);
            REQUIRE(domain);
            auto fitted = fit_boundary(make_staircase(size, turn, 35, 0.1), *domain, {}, context);
            REQUIRE(fitted);
            CAPTURE(thickness);
            check_islands(fitted->fitted, true);
        }
    }
}

TEST_CASE("fit: quads that a path went round belong to the patch on their side of it") {
    // All curves of a cube are released but the one between front (y = 0) and top, whose path leaves it for
    // the front, two quads deep and eight wide: in its middle are six that are nearest to the front.
    Context context(1);
    const auto domain = build_domain(make_box(Point(1)), {}, context);
    REQUIRE(domain);
    const HexMesh mesh = *make_grid({.cells = {10, 10, 10}}, Parallel(1));
    const Topology topology = compute_topology(mesh);
    const fit::SurfaceMesh surface = fit::extract_surface(mesh, topology);
    std::vector<Point> placed;
    for (Index v : surface.vertex) placed.push_back(mesh.positions[v]);
    const auto vertex_at = [&](double x, double z) {
        Index best = 0;
        for (Index v = 0; v < placed.size(); ++v)
            if (glm::distance(placed[v], Point(x, 0, z)) < glm::distance(placed[best], Point(x, 0, z)))
                best = v;
        return best;
    };
    const fit::CurveNet net = fit::make_curve_net(
        *domain, fit::find_small_features(*domain, std::vector<double>(domain->model.corner_count(), 0.01)));
    fit::Capture capture;
    capture.anchor_vertex.assign(net.anchors.size(), kNoIndex);
    capture.path.resize(net.legs.size());
    const std::array<Point, 2> ends = {Point(0, 0, 1), Point(1, 0, 1)};
    for (Index l = 0; l < net.legs.size(); ++l) {
        const std::array<Index, 2> anchor = net.legs[l].anchor;
        const bool back = net.anchors[anchor[0]].place == ends[1] && net.anchors[anchor[1]].place == ends[0];
        const bool along = net.anchors[anchor[0]].place == ends[0] && net.anchors[anchor[1]].place == ends[1];
        if (!along && !back) continue;
        std::vector<Index>& path = capture.path[l];
        for (const auto& [x, z] : {std::pair(0.0, 1.0), std::pair(0.1, 1.0), std::pair(0.1, 0.9)})
            path.push_back(vertex_at(x, z));
        for (int i = 1; i <= 9; ++i) path.push_back(vertex_at(0.1 * i, 0.8));
        for (const auto& [x, z] : {std::pair(0.9, 0.9), std::pair(0.9, 1.0), std::pair(1.0, 1.0)})
            path.push_back(vertex_at(x, z));
        if (back) std::reverse(path.begin(), path.end());
        capture.anchor_vertex[anchor[0]] = path.front();
        capture.anchor_vertex[anchor[1]] = path.back();
    }
    const fit::Regions regions = fit::find_regions(surface, placed, *domain, net, capture, context);
    const auto patch_at = [&](const Point& p) {
        return domain->model.patch_of_triangle(domain->model.project_patch(kNoIndex, p).element);
    };
    const Index front = patch_at({0.51, 0, 0.5}), top = patch_at({0.51, 0.5, 1});
    for (Index q = 0; q < surface.quad.size(); ++q) {
        Point centre(0);
        for (Index v : surface.quad[q]) centre += 0.25 * placed[v];
        const bool is_gone_round =
            centre.y == 0 && centre.x > 0.1 && centre.x < 0.9 && centre.z > 0.8 && centre.z < 1;
        if (is_gone_round) CHECK(regions.quad_patch[q] == top);
        if (centre.y == 0 && centre.z < 0.8) CHECK(regions.quad_patch[q] == front);
    }
}

TEST_CASE("fit: no path goes round an anchor or another path") {
    // A ball of coarse triangles, some of whose edges are sharp enough to be features, most of them loose.
    Context context(1);
    std::size_t paths = 0, legs = 0;
    for (unsigned k = 0; k < 40; ++k) {
        const TriangleSoup soup =
            turned(roughen(make_icosahedron(), 0.1, k), rotation(0.3 + 0.4 * k, 0.2 + 0.3 * k));
        BoundaryOptions sharp;
        sharp.feature_angle_deg = 28;
        const auto domain = build_domain(soup, sharp, context);
        REQUIRE(domain);
        const auto inside = [&](const Point& x) { return glm::length(x) < 0.9; };
        for (const auto& [n, h] : {std::pair(20, 0.15), std::pair(15, 0.2), std::pair(12, 0.25)}) {
            const HexMesh mesh = make_staircase_of(inside, glm::dmat3(1), n, h);
            const Topology topology = compute_topology(mesh);
            const fit::SurfaceMesh surface = fit::extract_surface(mesh, topology);
            const std::vector<Point> placed = fit::fair_and_project(mesh, surface, *domain, {}, context);
            const fit::CurveNet net = fit::make_curve_net(
                *domain,
                fit::find_small_features(*domain, std::vector<double>(domain->model.corner_count(), h)));
            std::vector<Point> unfitted;
            for (Index v : surface.vertex) unfitted.push_back(mesh.positions[v]);
            const fit::Capture capture = fit::capture_features(
                surface, unfitted, placed, fit::VertexTree(surface, placed, {}), *domain, net, {}, context);
            legs += net.legs.size();
            for (Index l = 0; l < net.legs.size(); ++l) {
                const std::vector<Index>& path = capture.path[l];
                if (path.empty()) continue;
                ++paths;
                double length = 0;
                for (std::size_t i = 1; i < path.size(); ++i)
                    length += glm::distance(placed[path[i - 1]], placed[path[i]]);
                CAPTURE(k, n, l, path.size());
                CHECK(length < 2 * std::max(net.legs[l].length(),
                                            glm::distance(placed[path.front()], placed[path.back()])) +
                                   1.5 * h);
            }
        }
    }
    CAPTURE(paths, legs);
    CHECK(legs > 100);
    CHECK(paths > 0.8 * static_cast<double>(legs));
}

TEST_CASE("fit: curves without vertices at their ends are followed in between") {
    Context context(1);
    const Point size(1.1, 0.9, 0.8);
    const glm::dmat3 turn = rotation(0.27, 0.16);
    auto domain = build_domain(turned(make_box(size), turn), {}, context);
    REQUIRE(domain);
    FitOptions options;
    options.capture.reach = 1e-3; // no vertex is that near to a corner
    auto fitted = fit_boundary(make_staircase(size, turn, 45, 0.075), *domain, options, context);
    REQUIRE(fitted);
    CHECK(fitted->report.captured_corners == 0);
    CHECK(fitted->report.captured_curves == 0);
    CHECK(fitted->report.curve_length == Approx(4 * (1.1 + 0.9 + 0.8)));
    CHECK(fitted->report.followed_length > 0.6 * fitted->report.curve_length);
    CHECK(fitted->report.followed_length < fitted->report.curve_length);
    CHECK(!fitted->refine_cells.empty());
    check_ridges(fitted->fitted, *domain);
}

TEST_CASE("fit: a corner stands for those within a cell of it") {
    Context context(1);
    const Point size(1.1, 0.9, 0.8);
    const double h = 0.075;
    const glm::dmat3 turn = rotation(0.27, 0.16);
    auto domain = build_domain(turned(make_cut_box(size, 0.3 * h), turn), {}, context);
    REQUIRE(domain);
    REQUIRE(domain->open_edges == 0);
    REQUIRE(domain->model.corner_count() == 10);
    REQUIRE(domain->model.curve_count() == 15);
    auto fitted = fit_boundary(make_staircase(size, turn, 45, h), *domain, {}, context);
    REQUIRE(fitted);
    CHECK(fitted->report.captured_curves == 12);
    CHECK(fitted->report.captured_corners == 8);
    REQUIRE(fitted->report.released_curves.size() == 3);
    for (const auto& released : fitted->report.released_curves) CHECK(released.reason == fit::Release::small);
    check_ridges(fitted->fitted, *domain);

    auto large = build_domain(turned(make_cut_box(size, 4 * h), turn), {}, context);
    REQUIRE(large);
    const fit::SmallFeatures none = fit::find_small_features(*large, std::vector<double>(10, h));
    CHECK(std::count(none.too_small.begin(), none.too_small.end(), 1) == 0);
    for (Index c = 0; c < 10; ++c) CHECK(none.corner[c] == c);
}

TEST_CASE("fit: a plate of one cell has an edge across each end of its rim") {
    // A third or a tenth of the cells' size thick: most quads of its rim are nearest to a large side.
    Context context(1);
    for (const double thickness : {0.025, 0.008}) {
        CAPTURE(thickness);
        const auto domain = build_domain(make_box(Point(1.1, 0.9, thickness)), {}, context);
        REQUIRE(domain);
        const double h = 0.075;
        const double below = 0.5 * (thickness - h) + 0.1 * h;
        const Point low(-0.02, -0.01, below);
        HexMesh layer =
            *make_grid({.cells = {15, 12, 1}, .low = low, .high = low + h * Point(15, 12, 1)}, Parallel(1));
        const auto fitted = fit_boundary(std::move(layer), *domain, {}, context);
        REQUIRE(fitted);
        CHECK(fitted->report.captured_curves == 12);
        CHECK(fitted->report.captured_corners == 8);
        check_ridges(fitted->fitted, *domain);
    }
}

TEST_CASE("fit: short curves across the ends of plates stay, others become points") {
    Context context(1);
    const auto find = [](const Domain& domain, std::span<const Index> as_points) {
        const std::vector<double> sizes(domain.model.corner_count(), 0.1);
        return fit::find_small_features(domain, sizes, as_points);
    };
    const auto count = [](const std::vector<std::uint8_t>& flags) {
        return std::count(flags.begin(), flags.end(), 1);
    };
    const auto plate = build_domain(make_box(Point(1.1, 0.9, 0.02)), {}, context);
    REQUIRE(plate);
    const fit::SmallFeatures ends = find(*plate, {});
    CHECK(count(ends.one_edge) == 4);
    CHECK(count(ends.too_small) == 0);
    for (Index c = 0; c < 8; ++c) CHECK(ends.corner[c] == c);
    std::vector<Index> all(plate->model.curve_count());
    std::iota(all.begin(), all.end(), Index{0});
    const fit::SmallFeatures points = find(*plate, all);
    CHECK(count(points.one_edge) == 0);
    CHECK(count(points.too_small) == 4);
    // A bar has two short curves at each corner, a cut corner three: no single edge is across their ends.
    const auto bar = build_domain(make_box(Point(1.1, 0.02, 0.02)), {}, context);
    REQUIRE(bar);
    CHECK(count(find(*bar, {}).one_edge) == 0);
    const auto cut = build_domain(make_cut_box(Point(1), 0.02), {}, context);
    REQUIRE(cut);
    CHECK(count(find(*cut, {}).one_edge) == 0);
}

TEST_CASE("fit: the edge of a sharp wedge is captured") {
    Context context(1);
    const double h = 0.05, length = 1.3, width = 0.8;
    const double slope = std::tan(12.5 * std::numbers::pi / 180); // of its two sides: 25 degrees
    TriangleSoup wedge;
    for (double z : {0.0, width}) {
        wedge.vertices.emplace_back(0, 0, z); // the tip
        wedge.vertices.emplace_back(length, -slope * length, z);
        wedge.vertices.emplace_back(length, slope * length, z);
    }
    wedge.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                       {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    for (int trial = 0; trial < 4; ++trial) {
        CAPTURE(trial);
        const glm::dmat3 turn = rotation(0.11 + 0.2 * trial, 0.07 + 0.13 * trial);
        auto domain = build_domain(turned(wedge, turn), {}, context);
        REQUIRE(domain);
        REQUIRE(domain->model.curve_count() == 9);
        const auto inside = [&](const Point& x) {
            const double depth = (slope * x.x - std::abs(x.y)) / std::hypot(1, slope);
            return std::min({depth, length - x.x, x.z, width - x.z}) > 0.1 * h;
        };
        auto fitted = fit_boundary(make_staircase_of(inside, turn, 66, h), *domain, {}, context);
        REQUIRE(fitted);
        CHECK(fitted->report.captured_corners == 6);
        CHECK(fitted->report.followed_length > 0.9 * fitted->report.curve_length);
        for (const auto& released : fitted->report.released_curves)
            CHECK(domain->angle[released.curve].smallest > 26); // not the tip
        check_ridges(fitted->fitted, *domain);
    }
}

TEST_CASE("fit: a cancelled run ends as such") {
    Context context(1);
    const Point size(1.1, 0.9, 0.8);
    auto domain = build_domain(make_box(size), {}, context);
    REQUIRE(domain);
    context.cancel();
    auto fitted = fit_boundary(make_staircase(size, glm::dmat3(1), 30, 0.11), *domain, {}, context);
    REQUIRE(!fitted);
    CHECK(fitted.error().code == ErrorCode::cancelled);
}
