#include "quality/mesh_quality.hpp"

#include "quality/hexes.hpp"
#include "quality/report_json.hpp"
#include "quality/report_text.hpp"
#include "samples/box_mesh.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <nlohmann/json.hpp>

using namespace hexopt;
using namespace hexopt::test;

namespace {

QualityReport report_of(const HexMesh& mesh, int threads = 2, QualityOptions options = {}) {
    Context context(threads);
    Result<QualityReport> report = compute_quality(mesh, compute_topology(mesh), options, context);
    REQUIRE(report);
    return std::move(*report);
}

HexMesh perturbed_grid(Index n, double shift) {
    HexMesh mesh = unit_grid(n, n, n);
    std::mt19937_64 random(41);
    for (Point& p : mesh.positions) p += random_hex(random, shift)[0];
    return mesh;
}

} // namespace

TEST_CASE("a grid of unit cubes is ideal in every figure") {
    const QualityReport r = report_of(unit_grid(3, 4, 5));
    CHECK(r.cells == 60);
    CHECK(r.vertices == 120);
    CHECK(r.boundary_faces == 2 * (12 + 15 + 20));
    CHECK(r.validity.is_valid());
    CHECK(r.scaled_jacobian.min == 1);
    CHECK(r.scaled_jacobian_histogram.count.back() == 60);
    CHECK(r.dihedral_histogram.count[9] == 60 * 24);
    CHECK(r.min_dihedral_histogram.count[9] == 60);
    CHECK(r.aspect_ratio.max == 1);
    CHECK(r.min_edge == 1);
    CHECK(r.mean_edge == 1);
    CHECK(r.total_volume == 60);
    CHECK(r.neighbour_volumes.faces == 2 * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4);
    CHECK(r.neighbour_volumes.max == 1);
    CHECK(r.neighbour_volumes.undefined == 0);
    CHECK(r.box_max == Point(3, 4, 5));
    REQUIRE(r.worst.size() == 10);
    CHECK(r.worst[0].cell == 0);
    CHECK(r.worst[9].cell == 9);
}

TEST_CASE("volume ratios are those of neighbouring layers") {
    HexMesh mesh = unit_grid(1, 1, 4);
    for (Point& p : mesh.positions) p.z = p.z * p.z * p.z; // layers 1, 7, 19, 37
    const NeighbourVolumes n = report_of(mesh).neighbour_volumes;
    CHECK(n.faces == 3);
    CHECK(n.max == Approx(7));
    CHECK(n.mean == Approx((7 + 19.0 / 7 + 37.0 / 19) / 3));
    CHECK(n.histogram == std::array<std::size_t, 5>{1, 1, 1, 0, 0});
    CHECK(n.worst.cell == 0);
    for (int k = 16; k < 20; ++k) mesh.positions[k].z = 8; // the last layer is turned over
    CHECK(report_of(mesh).neighbour_volumes.undefined == 1);
}

TEST_CASE("volume ratios count a coarse face once for each fine part") {
    // Three cubes in a row, of which the one in the middle is cut in eight.
    std::vector<LatticeBox> boxes = {{{0, 0, 0}, {2, 2, 2}, 0}, {{4, 0, 0}, {2, 2, 2}, 0}};
    for (std::uint32_t k = 0; k < 8; ++k) boxes.push_back({{2 + (k & 1), k >> 1 & 1, k >> 2}, {1, 1, 1}, 1});
    const Result<HexMesh> mesh = make_box_mesh(boxes, 2);
    REQUIRE(mesh);
    const QualityReport r = report_of(*mesh);
    CHECK(r.hanging_vertices == 10);
    CHECK(r.neighbour_volumes.faces == 12 + 4 + 4);
    CHECK(r.neighbour_volumes.max == Approx(8));
    CHECK(r.neighbour_volumes.mean == Approx((12 + 8 * 8) / 20.0));
    CHECK(r.neighbour_volumes.histogram == std::array<std::size_t, 5>{12, 0, 8, 0, 0});
    CHECK(r.boundary_faces == 2 * 5 + 4 * 4);
    CHECK(r.total_volume == Approx(3));
}

TEST_CASE("the report does not depend on the number of threads") {
    const HexMesh mesh = perturbed_grid(20, 0.4);
    QualityOptions options;
    options.keep_cells = true;
    const QualityReport one = report_of(mesh, 1, options), four = report_of(mesh, 4, options);
    CHECK(to_json(one).dump() == to_json(four).dump());
    CHECK(to_text(one) == to_text(four));
    REQUIRE(one.per_cell.size() == mesh.cell_count());
    const ValidityCounts counts = compute_validity(mesh, Parallel(2));
    CHECK(counts.concave_cells == one.validity.concave_cells);
    CHECK(counts.min_scaled_jacobian == one.scaled_jacobian.min);
    CHECK(one.scaled_jacobian.mean == Approx(counts.mean_scaled_jacobian));
}

TEST_CASE("sums agree with the cells, the worst come first") {
    const HexMesh mesh = perturbed_grid(12, 0.35);
    QualityOptions options;
    options.keep_cells = true;
    options.worst_count = 100;
    const QualityReport r = report_of(mesh, 2, options);
    double volume = 0;
    std::size_t concave = 0, angles_below_30 = 0;
    for (const CellQuality& c : r.per_cell) {
        volume += c.volume;
        concave += c.validity.is_concave();
        angles_below_30 += c.min_dihedral < 30;
    }
    CHECK(r.total_volume == Approx(volume));
    CHECK(r.validity.concave_cells == concave);
    CHECK(r.min_dihedral_histogram.count[0] + r.min_dihedral_histogram.count[1] +
              r.min_dihedral_histogram.count[2] ==
          angles_below_30);
    CHECK(r.dihedral_histogram.total() == 24 * mesh.cell_count());
    CHECK(r.scaled_jacobian_histogram.total() == mesh.cell_count());
    REQUIRE(r.worst.size() == 100);
    bool usable = false;
    double last = -2;
    for (const ListedCell& listed : r.worst) {
        const CellValidity& v = listed.quality.validity;
        const bool is_usable = !v.is_concave() && v.validity == Validity::valid;
        CHECK((is_usable || !usable));
        if (is_usable != usable) last = -2;
        usable = is_usable;
        CHECK(v.scaled_jacobian >= last);
        last = v.scaled_jacobian;
    }
}

TEST_CASE("a cell that is not finite is reported, not averaged") {
    HexMesh mesh = unit_grid(2, 2, 2);
    mesh.positions[0].y = std::numeric_limits<double>::infinity();
    const QualityReport r = report_of(mesh);
    CHECK(r.validity.nonfinite_cells == 1);
    CHECK(r.validity.invalid == 1);
    CHECK(r.scaled_jacobian.min == -1);
    CHECK(r.volume.count == 7);
    CHECK(r.total_volume == 7);
    CHECK(r.worst[0].cell == 0);
    CHECK(r.box_max == Point(2, 2, 2));
    CHECK(to_text(r).find("not finite") != std::string::npos);
}

TEST_CASE("an empty mesh has an empty report") {
    const QualityReport r = report_of(HexMesh{});
    CHECK(r.validity.is_valid());
    CHECK(r.worst.empty());
    CHECK(to_json(r)["cells"] == 0);
    CHECK_FALSE(to_text(r).empty());
}

TEST_CASE("infinite figures become null") {
    HexMesh mesh = unit_grid(1, 1, 1);
    mesh.positions[1] = mesh.positions[0];
    const nlohmann::json json = nlohmann::json::parse(to_json(report_of(mesh)).dump());
    CHECK(json["aspect_ratio"]["max"].is_null());
    CHECK(json["validity"]["jacobian_undecided"] == 1);
    CHECK(json["worst_cells"][0]["jacobian"] == "undecided");
}

TEST_CASE("a cancelled measurement says so") {
    const HexMesh mesh = unit_grid(4, 4, 4);
    Context context(1);
    context.cancel();
    const Result<QualityReport> report = compute_quality(mesh, compute_topology(mesh), {}, context);
    REQUIRE_FALSE(report);
    CHECK(report.error().code == ErrorCode::cancelled);
}
