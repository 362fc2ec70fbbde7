#include "mesh/hex_reference.hpp"
#include "mesh/topology.hpp"
#include "samples/box_mesh.hpp"
#include "stages/fit/corner_fans.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>

using namespace hexopt;
using namespace hexopt::fit;

namespace {

using Octant = std::array<int, 3>;

/// Surface of unit cubes at the given places, two triangles a square, one patch.
TriangleSoup make_cubes(const std::vector<Octant>& cubes) {
    TriangleSoup soup;
    for (const Octant& at : cubes)
        for (const auto& face : hex::kFaceVertex) {
            Point sum(0);
            for (int v : face) sum += 0.25 * Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]);
            const Point out = 2.0 * (sum - Point(0.5));
            const Octant beside = {at[0] + static_cast<int>(out.x), at[1] + static_cast<int>(out.y),
                                   at[2] + static_cast<int>(out.z)};
            if (std::find(cubes.begin(), cubes.end(), beside) != cubes.end()) continue;
            std::array<Index, 4> corner;
            for (std::size_t k = 0; k < 4; ++k) {
                const int v = face[k];
                const Point p =
                    Point(at[0], at[1], at[2]) + Point(hex::kVertexX[v], hex::kVertexY[v], hex::kVertexZ[v]);
                const auto known = std::find(soup.vertices.begin(), soup.vertices.end(), p);
                corner[k] = static_cast<Index>(known - soup.vertices.begin());
                if (known == soup.vertices.end()) soup.vertices.push_back(p);
            }
            soup.triangles.push_back({corner[0], corner[1], corner[2]});
            soup.triangles.push_back({corner[0], corner[2], corner[3]});
        }
    return soup;
}

std::vector<Octant> cube_without_an_octant() {
    std::vector<Octant> cubes;
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i)
                if (i + j + k < 3) cubes.push_back({i, j, k});
    return cubes;
}

/// Two legs of one unit from a place, in two directions of the plane z = 0 of it; degrees.
CurveNet make_two_legs(const Point& place, double first_deg, double second_deg) {
    CurveNet net;
    net.anchors.push_back({place, 0, kNoIndex});
    for (double angle : {first_deg, second_deg}) {
        const double a = angle * std::numbers::pi / 180;
        const Point end = place + Point(std::cos(a), std::sin(a), 0);
        net.anchors.push_back({end, static_cast<Index>(net.anchors.size()), kNoIndex});
        const auto last = static_cast<Index>(net.anchors.size() - 1);
        net.legs.push_back({static_cast<Index>(net.legs.size()), {0, last}, {place, end}, {0, 1}});
    }
    net.anchor_leg.offset = {0, 2, 3, 4};
    net.anchor_leg.item = {0, 1, 0, 1};
    return net;
}

} // namespace

TEST_CASE("corner fans: sectors add up to what the surface turns, in order seen from outside") {
    Context context(1);
    const auto domain = build_domain(make_cubes(cube_without_an_octant()), {}, context);
    REQUIRE(domain);
    const std::vector<double> sizes(domain->model.corner_count(), 0.01);
    const CurveNet net = make_curve_net(*domain, find_small_features(*domain, sizes));
    const std::vector<CornerFan> fans = find_corner_fans(*domain, net);
    double missing = 0; // of 360 degrees: 720 in all on a closed surface without handles
    std::size_t wide = 0;
    for (Index a = 0; a < fans.size(); ++a) {
        const CornerFan& fan = fans[a];
        REQUIRE(fan.leg.size() == net.anchor_leg[a].size());
        REQUIRE(fan.angle_deg.size() == fan.leg.size());
        missing += 360 - std::accumulate(fan.angle_deg.begin(), fan.angle_deg.end(), 0.0);
        for (std::size_t k = 0; k < fan.leg.size(); ++k) {
            wide += fan.angle_deg[k] > 269;
            const Leg &leg = net.legs[fan.leg[k]], &next = net.legs[fan.leg[(k + 1) % fan.leg.size()]];
            const auto along = [&](const Leg& l) {
                return l.anchor[0] == a ? l.points[1] - l.points[0]
                                        : l.points[l.points.size() - 2] - l.points.back();
            };
            const Point turn = glm::cross(along(leg), along(next));
            const Point middle = net.anchors[a].place + 0.1 * (along(leg) + along(next));
            // In a sector of 90 degrees the turn points outwards.
            if (fan.angle_deg[k] < 91) {
                const Projection at = domain->model.project_patch(kNoIndex, middle);
                CHECK(at.distance < 1e-12);
                CHECK(glm::dot(turn, at.direction) > 0);
            }
        }
    }
    CHECK(missing == Approx(720));
    CHECK(wide == 3);
}

TEST_CASE("corner fans: first edges leave room for as many quads as the angles need") {
    OctreeOptions lattice;
    lattice.levels = 0;
    const auto mesh = make_box_mesh(make_octree_boxes(lattice), lattice_units(0));
    REQUIRE(mesh);
    const SurfaceMesh surface = extract_surface(*mesh, compute_topology(*mesh, Parallel(1)));
    std::vector<Point> placed;
    Index middle = kNoIndex; // of the top
    for (Index v = 0; v < surface.vertex.size(); ++v) {
        placed.push_back(mesh->positions[surface.vertex[v]]);
        if (placed.back() == Point(2, 2, 4)) middle = v;
    }
    REQUIRE(middle != kNoIndex);
    const CurveNet net = make_two_legs(placed[middle], 0, 135);
    const auto second_edge = [&](double angle_deg) {
        const std::vector<CornerFan> fans = {{{0, 1}, {angle_deg, 360 - angle_deg}}, {}, {}};
        const RingChoice choice =
            RingChooser(surface, placed, net, fans).choose(0, middle, [](Index, Index) { return 0.0; });
        REQUIRE(choice.neighbour.size() == 2);
        CHECK(placed[choice.neighbour[0]] == Point(3, 2, 4));
        CHECK(choice.sectors == Approx(0).margin(1e-12));
        return placed[choice.neighbour[1]];
    };
    // 135 degrees is as near to one edge as to the other.
    CHECK(second_edge(90) == Point(2, 3, 4));
    CHECK(second_edge(180) == Point(1, 2, 4));

    // What another leg has already is passed by.
    const std::vector<CornerFan> fans = {{{0, 1}, {90, 270}}, {}, {}};
    const RingChoice choice = RingChooser(surface, placed, net, fans).choose(0, middle, [&](Index u, Index) {
        return placed[u] == Point(2, 3, 4) ? 20.0 : 0.0;
    });
    REQUIRE(choice.neighbour.size() == 2);
    CHECK(placed[choice.neighbour[1]] == Point(1, 2, 4));
}
