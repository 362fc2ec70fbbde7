#include "quality/mesh_validity.hpp"

#include "quality/hexes.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <limits>

using namespace hexopt;
using namespace hexopt::test;

namespace {

/// Cells that share no vertices, each the unit cube moved at random.
HexMesh loose_cells(std::size_t count, double shift) {
    std::mt19937_64 random(31);
    HexMesh mesh;
    for (std::size_t c = 0; c < count; ++c) {
        Cell cell;
        for (int k = 0; k < 8; ++k) cell[k] = static_cast<Index>(8 * c + k);
        mesh.cells.push_back(cell);
        for (const Point& p : random_hex(random, shift)) mesh.positions.push_back(p);
    }
    return mesh;
}

} // namespace

TEST_CASE("mesh counts are the sums over the cells, the same bits for any number of threads") {
    HexMesh mesh = loose_cells(20000, 0.4);
    mesh.positions[77].x = std::numeric_limits<double>::quiet_NaN();
    const Parallel one(1), four(4);
    const std::vector<CellValidity> cells = compute_cell_validities(mesh, four);
    const ValidityCounts counts = compute_validity(mesh, one), again = compute_validity(mesh, four),
                         kept = count_validity(cells, four);
    CHECK(std::memcmp(&counts.mean_scaled_jacobian, &again.mean_scaled_jacobian, sizeof(double)) == 0);
    CHECK(std::memcmp(&counts.mean_scaled_jacobian, &kept.mean_scaled_jacobian, sizeof(double)) == 0);
    CHECK(counts.worst_cell == again.worst_cell);
    CHECK(counts.cells == 20000);
    CHECK(counts.nonfinite_cells == 1);
    CHECK(counts.worst_cell == 9);
    CHECK(counts.min_scaled_jacobian == -1);
    CHECK(counts.valid + counts.invalid + counts.undecided == counts.cells);
    std::size_t concave8 = 0, concave24 = 0, concave = 0, valid = 0;
    for (const CellValidity& c : cells) {
        concave8 += c.concave8 > 0;
        concave24 += c.concave24 > 0;
        concave += c.is_concave();
        valid += c.validity == Validity::valid;
    }
    CHECK(counts.concave8_cells == concave8);
    CHECK(counts.concave24_cells == concave24);
    CHECK(counts.concave_cells == concave);
    CHECK(again.valid == valid);
    CHECK_FALSE(counts.is_valid());
}

TEST_CASE("a mesh of mildly moved cubes is valid, an empty one too") {
    CHECK(compute_validity(loose_cells(100, 0.05), Parallel(2)).is_valid());
    const ValidityCounts none = compute_validity(HexMesh{}, Parallel(2));
    CHECK(none.is_valid());
    CHECK(none.worst_cell == kNoIndex);
    CHECK(none.min_scaled_jacobian == 1);
}
