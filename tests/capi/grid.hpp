#pragma once

#include <cstdint>
#include <vector>

/// A structured grid of unit cubes, in the arrays that the interface takes.
struct Grid {
    int cells_along, vertices_along;
    std::vector<double> positions;
    std::vector<std::uint32_t> cells;

    explicit Grid(int n) : cells_along(n), vertices_along(n + 1) {
        for (int z = 0; z <= n; ++z)
            for (int y = 0; y <= n; ++y)
                for (int x = 0; x <= n; ++x) positions.insert(positions.end(), {1.0 * x, 1.0 * y, 1.0 * z});
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x)
                    for (int k = 0; k < 8; ++k)
                        cells.push_back(vertex(x + (k % 4 == 1 || k % 4 == 2), y + (k % 4 >= 2), z + k / 4));
    }

    std::uint32_t vertex(int x, int y, int z) const {
        return static_cast<std::uint32_t>((z * vertices_along + y) * vertices_along + x);
    }

    /// Pulls the vertex in the middle through its neighbours.
    void tangle() { positions[3 * vertex(cells_along / 2, cells_along / 2, cells_along / 2)] += 1.6; }
};
