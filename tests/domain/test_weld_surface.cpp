#include "core/random.hpp"
#include "domain/domain.hpp"
#include "domain/weld_surface.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

/// Unit sphere as a grid of 2 n by n quads cut in two, poles closed.
TriangleSoup make_sphere(int n) {
    TriangleSoup soup;
    const double pi = 3.14159265358979323846;
    const auto at = [&](int i, int j) { return static_cast<Index>((j - 1) * 2 * n + i % (2 * n)); };
    for (int j = 1; j < n; ++j)
        for (int i = 0; i < 2 * n; ++i) {
            const double theta = pi * j / n, phi = pi * i / n;
            soup.vertices.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                       std::cos(theta));
        }
    const auto north = static_cast<Index>(soup.vertices.size());
    soup.vertices.emplace_back(0, 0, 1);
    soup.vertices.emplace_back(0, 0, -1);
    for (int i = 0; i < 2 * n; ++i) {
        soup.triangles.push_back({north, at(i, 1), at(i + 1, 1)});
        soup.triangles.push_back({north + 1, at(i + 1, n - 1), at(i, n - 1)});
        for (int j = 1; j + 1 < n; ++j) {
            soup.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            soup.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    }
    return soup;
}

/// Every triangle with vertices of its own, moved by up to `gap`.
TriangleSoup torn(const TriangleSoup& soup, double gap, Random& random) {
    TriangleSoup result;
    for (const auto& t : soup.triangles) {
        std::array<Index, 3> own;
        for (int k = 0; k < 3; ++k) {
            own[k] = static_cast<Index>(result.vertices.size());
            const Point noise(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
            result.vertices.push_back(soup.vertices[t[k]] + gap * noise);
        }
        result.triangles.push_back(own);
    }
    return result;
}

} // namespace

TEST_CASE("weld: a torn sphere closes again and keeps its triangles") {
    Context context(1);
    Random random(7);
    const TriangleSoup sphere = make_sphere(12);
    for (double gap : {0.0, 1e-6, 1e-4, 1e-3}) {
        CAPTURE(gap);
        auto welded = weld_surface(torn(sphere, gap, random), 2 * gap, context);
        REQUIRE(welded);
        CHECK(welded->report.open_edges_after == 0);
        CHECK(welded->soup.triangles.size() == sphere.triangles.size());
        CHECK(welded->report.dropped_triangles == 0);
    }
}

TEST_CASE("weld: whole edges are joined over wider gaps than vertices, holes of that width are left") {
    Context context(1);
    Random random(9);
    const TriangleSoup sphere = make_sphere(12);
    for (double gap : {1e-3, 3e-3, 6e-3}) {
        CAPTURE(gap);
        auto welded = weld_surface(torn(sphere, gap, random), gap / 4, context);
        REQUIRE(welded);
        CHECK(welded->report.open_edges_after == 0);
        CHECK(welded->soup.triangles.size() == sphere.triangles.size());
        CHECK(welded->report.dropped_triangles == 0);
    }
    // Of a strip of squares of 0.1 one is missing: its sides face one another 10 tolerances apart.
    TriangleSoup strip;
    for (int i = 0; i <= 5; ++i)
        for (int j = 0; j < 2; ++j) strip.vertices.emplace_back(0.1 * i, 0.1 * j, 0);
    for (Index i = 0; i < 5; ++i)
        if (i != 2) {
            strip.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
            strip.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
        }
    auto holed = weld_surface(strip, 0.0101, context);
    REQUIRE(holed);
    CHECK(holed->report.merged_vertices == 0);
    CHECK(holed->report.open_edges_after == holed->report.open_edges_before);
}

TEST_CASE("weld: gaps wider than the tolerance and closed parts stay") {
    Context context(1);
    Random random(8);
    const TriangleSoup sphere = make_sphere(8);
    auto open = weld_surface(torn(sphere, 0.05, random), 1e-9, context);
    REQUIRE(open);
    CHECK(open->report.open_edges_after == 3 * sphere.triangles.size());
    auto closed = weld_surface(sphere, 0.5, context);
    REQUIRE(closed);
    CHECK(closed->soup.vertices == sphere.vertices);
    CHECK(closed->soup.triangles == sphere.triangles);
}

TEST_CASE("weld: triangles are cut where other vertices lie on their edges") {
    Context context(1);
    TriangleSoup soup = make_sphere(6);
    // One triangle becomes two, cut at the middle of an edge that its neighbour keeps whole.
    const std::array<Index, 3> t = soup.triangles.back();
    const auto middle = static_cast<Index>(soup.vertices.size());
    soup.vertices.push_back(0.5 * (soup.vertices[t[0]] + soup.vertices[t[1]]));
    soup.triangles.back() = {t[0], middle, t[2]};
    soup.triangles.push_back({middle, t[1], t[2]});
    soup.patch.assign(soup.triangles.size(), 0);
    soup.patch_names = {"ball"};
    auto welded = weld_surface(soup, 1e-9, context);
    REQUIRE(welded);
    CHECK(welded->report.open_edges_before == 3);
    CHECK(welded->report.cut_triangles == 1);
    CHECK(welded->report.open_edges_after == 0);
    CHECK(welded->soup.patch.size() == welded->soup.triangles.size());
    auto domain = build_domain(welded->soup, {}, context);
    REQUIRE(domain);
    CHECK(domain->open_edges == 0);
}

TEST_CASE("weld: collapsed triangles laid upon edges of a closed surface go") {
    Context context(1);
    const TriangleSoup sphere = make_sphere(6);
    TriangleSoup soup = sphere;
    for (std::size_t t = 0; t < 30; t += 5) {
        const std::array<Index, 3> at = sphere.triangles[t];
        soup.triangles.push_back({at[0], at[1], static_cast<Index>(soup.vertices.size())});
        soup.vertices.push_back(0.3 * soup.vertices[at[0]] + 0.7 * soup.vertices[at[1]]);
    }
    auto welded = weld_surface(soup, 1e-6, context);
    REQUIRE(welded);
    CHECK(welded->report.open_edges_before == 12);
    CHECK(welded->report.dropped_triangles == 6);
    CHECK(welded->report.open_edges_after == 0);
    CHECK(welded->soup.triangles == sphere.triangles);

    soup = sphere; // a fin that stands up is not one of them
    soup.triangles.push_back(
        {sphere.triangles[0][0], sphere.triangles[0][1], static_cast<Index>(soup.vertices.size())});
    soup.vertices.push_back(1.1 *
                            (soup.vertices[soup.triangles[0][0]] + soup.vertices[soup.triangles[0][1]]));
    welded = weld_surface(soup, 1e-6, context);
    REQUIRE(welded);
    CHECK(welded->soup.triangles == soup.triangles);
}

TEST_CASE("weld: what cannot be used is refused") {
    Context context(1);
    TriangleSoup soup = make_sphere(4);
    CHECK(!weld_surface(soup, -1, context));
    soup.triangles[3][1] = 100000;
    CHECK(weld_surface(soup, 0, context).error().code == ErrorCode::bad_input);
    soup = make_sphere(4);
    soup.vertices[2].y = std::nan("");
    CHECK(weld_surface(soup, 0, context).error().code == ErrorCode::bad_input);
}
