#include "pipeline/reach_features.hpp"

#include "io/read_surface.hpp"
#include "pipeline/mesh_attempt.hpp"
#include "pipeline/mesh_surface.hpp"
#include "quality/mesh_quality.hpp"
#include "samples/grid.hpp"
#include "support/shapes.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

constexpr int kCells = 6;

/// A cube of edge kCells with a feature from `a` to `b` on its upper side that no edge of the mesh follows.
struct Marked {
    Context context{1};
    Domain domain;
    FittedMesh fitted;
    Topology topology;
    Point a, b;

    Marked(const Point& from, const Point& to) : a(from), b(to) {
        TriangleSoup soup = make_box_surface(Point(0), Point(kCells), 1);
        const auto upper = [&](const std::array<Index, 3>& t) {
            return std::all_of(t.begin(), t.end(), [&](Index v) { return soup.vertices[v].z == kCells; });
        };
        std::erase_if(soup.triangles, upper);
        const double k = kCells;
        const std::array<Point, 4> corner = {Point(0, 0, k), Point(k, 0, k), Point(k, k, k), Point(0, k, k)};
        const auto add = [&](const Point& p, const Point& q, const Point& r) {
            const auto first = static_cast<Index>(soup.vertices.size());
            soup.vertices.insert(soup.vertices.end(), {p, q, r});
            soup.triangles.push_back({first, first + 1, first + 2});
        };
        add(corner[0], corner[1], a);
        add(corner[1], b, a);
        add(corner[1], corner[2], b);
        add(corner[2], corner[3], b);
        add(corner[3], a, b);
        add(corner[3], corner[0], a);
        std::array<Index, 2> edge{};
        for (Index v = 0; v < soup.vertices.size(); ++v) {
            if (soup.vertices[v] == a) edge[0] = v;
            if (soup.vertices[v] == b) edge[1] = v;
        }
        auto built = build_domain(soup, {}, context, std::vector<std::array<Index, 2>>{edge});
        REQUIRE(built);
        domain = std::move(*built);
        REQUIRE(domain.model.corner_count() == 10);
        REQUIRE(domain.model.curve_count() == 13);
        make_mesh();
        bind();
    }

    static Index at(int i, int j, int k) {
        return static_cast<Index>((k * (kCells + 1) + j) * (kCells + 1) + i);
    }

    void make_mesh() {
        HexMesh& mesh = fitted.mesh;
        mesh = *make_grid({.cells = {kCells, kCells, kCells}, .high = Point(kCells)}, Parallel(1));
        topology = compute_topology(mesh);
    }

    /// By the sides of the cube that vertices lie on; its edges are followed, the feature on it is not.
    void bind() {
        const BoundaryModel& model = domain.model;
        const HexMesh& mesh = fitted.mesh;
        for (const Point& x : mesh.positions) {
            int sides = 0;
            for (int d = 0; d < 3; ++d) sides += x[d] == 0 || x[d] == kCells;
            Association on;
            if (sides == 1)
                on = {EntityKind::patch, model.patch_of_triangle(model.project_patch(kNoIndex, x).element)};
            if (sides == 2)
                on = {EntityKind::curve, model.curve_of_segment(model.project_curve(kNoIndex, x).element)};
            for (Index c = 0; c < model.corner_count() && sides == 3; ++c)
                if (model.corner_point(c) == x) on = {EntityKind::corner, c};
            fitted.association.push_back(on);
        }
        for (Index v = 0; v < mesh.vertex_count(); ++v)
            for (int d = 0; d < 3; ++d) {
                Point ahead = mesh.positions[v];
                ahead[d] += 1;
                int sides = 0;
                for (int e = 0; e < 3; ++e) sides += e != d && (ahead[e] == 0 || ahead[e] == kCells);
                if (sides < 2 || ahead[d] > kCells) continue;
                const Index u =
                    at(static_cast<int>(ahead.x), static_cast<int>(ahead.y), static_cast<int>(ahead.z));
                const Point middle = 0.5 * (mesh.positions[v] + ahead);
                fitted.ridges.push_back(
                    {std::min(u, v), std::max(u, v),
                     model.curve_of_segment(model.project_curve(kNoIndex, middle).element)});
            }
        bind_surface(domain, fitted);
    }

    std::size_t vertices_at(const Point& place) const {
        return static_cast<std::size_t>(
            std::count(fitted.mesh.positions.begin(), fitted.mesh.positions.end(), place));
    }
    bool is_valid() {
        const auto quality = compute_quality(fitted.mesh, topology, {}, context);
        REQUIRE(quality);
        return quality->validity.is_valid();
    }
};

} // namespace

TEST_CASE("corners that no vertex is on get one, which is bound to them") {
    Marked marked({2.4, 3.3, kCells}, {4.3, 2.6, kCells});
    REQUIRE(marked.vertices_at(marked.a) + marked.vertices_at(marked.b) == 0);
    const auto report = reach_features(marked.fitted, marked.topology, marked.domain, {}, marked.context);
    REQUIRE(report);
    CHECK(report->corners == 10);
    CHECK(report->corners_before == 8);
    CHECK(report->corners_after == 10);
    CHECK(report->off_before == 0);
    CHECK(report->off_after == 0);
    const double cube = 12 * kCells;
    CHECK(report->followed_after_rel == Approx(cube / (cube + glm::distance(marked.a, marked.b))));
    CHECK(marked.vertices_at(marked.a) == 1);
    CHECK(marked.vertices_at(marked.b) == 1);
    std::size_t corners = 0;
    for (const Association& on : marked.domain.model.associations()) corners += on.kind == EntityKind::corner;
    CHECK(corners == 10);
    CHECK(marked.is_valid());
}

TEST_CASE(
    "places that are no corners get a vertex that stays bound to its patch, off the surface none does") {
    Marked marked({2.4, 3.3, kCells}, {4.3, 2.6, kCells});
    const Point place(1.3, 4.6, kCells), off(4.6, 4.6, kCells + 0.5);
    ReachFeaturesOptions options;
    options.more_places = {place, off};
    const auto report =
        reach_features(marked.fitted, marked.topology, marked.domain, options, marked.context);
    REQUIRE(report);
    CHECK(report->corners == 10);
    CHECK(report->corners_before == 8);
    CHECK(report->corners_after == 10);
    REQUIRE(marked.vertices_at(place) == 1);
    CHECK(marked.vertices_at(off) == 0);
    const auto& positions = marked.fitted.mesh.positions;
    const auto v =
        static_cast<std::size_t>(std::find(positions.begin(), positions.end(), place) - positions.begin());
    CHECK(marked.fitted.association[v].kind == EntityKind::patch);
    CHECK(report->off_after == 0);
    CHECK(marked.is_valid());
}

TEST_CASE(
    "corners nearer to each other than vertices can be: one is hit at least, and all cells stay sound") {
    Marked marked({2.5, 2.5, kCells}, {2.5, 2.501, kCells});
    ReachFeaturesOptions options;
    const auto report =
        reach_features(marked.fitted, marked.topology, marked.domain, options, marked.context);
    REQUIRE(report);
    CHECK(report->corners_after >= 9);
    CHECK(marked.is_valid());
    const auto quality = compute_quality(marked.fitted.mesh, marked.topology, {}, marked.context);
    REQUIRE(quality);
    CHECK(quality->validity.min_scaled_jacobian >= options.min_sj);
}

TEST_CASE("vertices that were let off their corners, curves and patches come home") {
    Marked marked({2, 3, kCells}, {4, 3, kCells});
    const Point shift(-0.2, -0.25, -0.15);
    for (Index v :
         {Marked::at(kCells, kCells, kCells), Marked::at(3, kCells, kCells), Marked::at(kCells, 2, 2)})
        marked.fitted.mesh.positions[v] += shift;
    const auto report = reach_features(marked.fitted, marked.topology, marked.domain, {}, marked.context);
    REQUIRE(report);
    CHECK(report->off_before == 3);
    CHECK(report->off_after == 0);
    CHECK(report->corners_before == 9);
    CHECK(report->corners_after == 10);
    CHECK(report->followed_before_rel < report->followed_after_rel);
    CHECK(marked.vertices_at(Point(kCells)) == 1);
    CHECK(marked.is_valid());
}

TEST_CASE("real models: corners that fitting missed are hit, and cells stay valid", "[slow]") {
    const auto file = std::filesystem::path(HEXOPT_SHARED_DATA) / "geometry/single_orifice.stl";
    if (!std::filesystem::exists(file)) HEXOPT_SKIP("no shared geometry single_orifice.stl");
    Context context(2);
    const auto soup = read_surface(file, context);
    REQUIRE(soup);
    MeshOptions options;
    options.refine.target_cells = 15000;
    StageClock clock;
    const auto outcome = mesh_surface(*soup, options, clock, context);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    REQUIRE(outcome->reached);
    CHECK(outcome->reached->corners_after >= outcome->reached->corners_before + 20);
    CHECK(outcome->after.validity.is_valid());
    CHECK(outcome->after.validity.min_scaled_jacobian >= 0.2);
    CHECK(outcome->contacts.empty());
}
