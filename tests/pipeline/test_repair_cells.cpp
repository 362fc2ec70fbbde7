#include "pipeline/repair_cells.hpp"
#include "samples/grid.hpp"

#include <catch2/catch.hpp>
#include <numeric>

using namespace hexopt;

namespace {

/// n*n*n unit cells, x fastest.
HexMesh grid(Index n) { return *make_grid({.cells = {n, n, n}, .high = Point(n)}, Parallel(1)); }

HexMesh shifted(HexMesh mesh, double scale, Point by) {
    for (Point& p : mesh.positions) p = scale * p + by;
    return mesh;
}

} // namespace

TEST_CASE("cells round a cell are those that hold its vertices, and rings of neighbours") {
    const HexMesh octree = grid(9);
    const HexMesh small = shifted(grid(1), 0.2, Point(4.4)); // inside the middle cell
    const std::vector<Index> cell{0};
    const Index middle = 4 + 9 * (4 + 9 * 4);
    CHECK(find_cells_round(octree, small, cell, 0) == std::vector<Index>{middle});
    CHECK(find_cells_round(octree, small, cell, 1).size() == 27);
    CHECK(find_cells_round(octree, small, cell, 2).size() == 125);
    CHECK(find_cells_round(octree, small, {}, 1).empty());
}

TEST_CASE("a cell across several finds each, one outside none") {
    const HexMesh octree = grid(5);
    const std::vector<Index> cell{0};
    CHECK(find_cells_round(octree, shifted(grid(1), 1, Point(1.5)), cell, 0).size() == 8);
    CHECK(find_cells_round(octree, shifted(grid(1), 1, Point(7)), cell, 3).empty());
    std::vector<Index> all(octree.cell_count());
    std::iota(all.begin(), all.end(), 0);
    CHECK(find_cells_round(octree, shifted(octree, 0.98, Point(0.05)), all, 0) == all);
}

TEST_CASE("a ring takes the cells along that are no smaller") {
    HexMesh octree = grid(9);
    const auto at = [](Index x, Index y, Index z) { return x + 9 * (y + 9 * z); };
    octree.level.assign(octree.cell_count(), 0);
    CHECK(add_ring(octree, std::vector<Index>{at(4, 4, 4)}).size() == 27);
    CHECK(add_ring(octree, {}).empty());
    for (Index c = 0; c < octree.cell_count(); ++c) octree.level[c] = c % 9 < 4; // as if smaller
    CHECK(add_ring(octree, std::vector<Index>{at(4, 4, 4)}).size() == 18);
    CHECK(add_ring(octree, std::vector<Index>{at(3, 4, 4)}).size() == 27);
    const std::vector<Index> both = add_ring(octree, std::vector<Index>{at(8, 8, 8), at(7, 8, 8)});
    CHECK(both == std::vector<Index>{at(6, 7, 7), at(7, 7, 7), at(8, 7, 7), at(6, 8, 7), at(7, 8, 7),
                                     at(8, 8, 7), at(6, 7, 8), at(7, 7, 8), at(8, 7, 8), at(6, 8, 8),
                                     at(7, 8, 8), at(8, 8, 8)});
}
