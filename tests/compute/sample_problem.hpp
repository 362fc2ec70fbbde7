#pragma once

#include "mesh/topology.hpp"
#include "stages/optimize/device_solver.hpp"

#include <random>

namespace hexopt::compute::testing {

/// Structured cube of n^3 unit cells whose inner vertices are moved at random by up to `amount`.
inline HexMesh perturbed_cube(int n, double amount, unsigned seed = 1) {
    HexMesh mesh;
    const auto vertex = [n](int x, int y, int z) {
        return static_cast<Index>(x + (n + 1) * (y + (n + 1) * z));
    };
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> uniform(-amount, amount);
    for (int z = 0; z <= n; ++z)
        for (int y = 0; y <= n; ++y)
            for (int x = 0; x <= n; ++x) {
                Point p(x, y, z);
                const bool inner = x % n && y % n && z % n;
                if (inner) p += Point(uniform(generator), uniform(generator), uniform(generator));
                mesh.positions.push_back(p);
            }
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x)
                mesh.cells.push_back({vertex(x, y, z), vertex(x + 1, y, z), vertex(x + 1, y + 1, z),
                                      vertex(x, y + 1, z), vertex(x, y, z + 1), vertex(x + 1, y, z + 1),
                                      vertex(x + 1, y + 1, z + 1), vertex(x, y + 1, z + 1)});
    return mesh;
}

/// The same bent, so that its best state is no lattice and max-min has something to do.
inline HexMesh bent_cube(int n, double amount, unsigned seed = 1) {
    HexMesh mesh = perturbed_cube(n, amount, seed);
    for (Point& p : mesh.positions)
        p = Point(p.x + 0.8 * p.y * p.z / n, p.y + 0.5 * p.x * p.z / n, p.z + 0.3 * p.x * p.x / n);
    return mesh;
}

/// A mesh with what the solver needs of it; movable: all vertices off the boundary.
struct SampleProblem {
    HexMesh mesh;
    Topology topology;
    std::unique_ptr<Problem> problem;

    explicit SampleProblem(HexMesh m) : mesh(std::move(m)), topology(compute_topology(mesh)) {
        std::vector<std::uint8_t> movable(mesh.vertex_count());
        for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = !topology.on_boundary[v];
        problem = std::make_unique<Problem>(mesh, topology, movable);
    }
};

} // namespace hexopt::compute::testing
