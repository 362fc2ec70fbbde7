// A 3 x 3 x 3 grid with one inner vertex pulled through its neighbours and one on the top face pushed aside.
// The boundary may slide on itself (the default), so that both come right.
#include <hexopt/hexopt.hpp>

#include <cstdio>
#include <vector>

namespace {

constexpr int kCells = 3, kVertices = kCells + 1;

std::uint32_t vertex_at(int x, int y, int z) {
    return static_cast<std::uint32_t>((z * kVertices + y) * kVertices + x);
}

std::vector<double> make_positions() {
    std::vector<double> positions;
    for (int z = 0; z < kVertices; ++z)
        for (int y = 0; y < kVertices; ++y)
            for (int x = 0; x < kVertices; ++x)
                positions.insert(positions.end(), {1.0 * x, 1.0 * y, 1.0 * z});
    positions[3 * vertex_at(1, 1, 1)] = 2.5;
    positions[3 * vertex_at(1, 1, 3)] = 1.8;
    return positions;
}

std::vector<std::uint32_t> make_cells() {
    std::vector<std::uint32_t> cells;
    for (int z = 0; z < kCells; ++z)
        for (int y = 0; y < kCells; ++y)
            for (int x = 0; x < kCells; ++x)
                for (int top = 0; top < 2; ++top) // VTK order: round the bottom face, then the top one
                    for (auto [dx, dy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
                        cells.push_back(vertex_at(x + dx, y + dy, z + top));
    return cells;
}

} // namespace

int main() {
    std::vector<double> positions = make_positions();
    const std::vector<std::uint32_t> cells = make_cells();
    const hexopt::Mesh mesh{.positions = positions, .cells = cells};
    try {
        hexopt::Optimizer optimizer;
        const hexopt_quality before = optimizer.measure(mesh);
        const hexopt::OptimizeResult result = optimizer.optimize(mesh);
        const hexopt_quality after = optimizer.measure(mesh);
        std::printf("%s: cells valid %d -> %d of %zu, minimum scaled Jacobian %.3f -> %.3f\n",
                    hexopt_status_name(result.status), static_cast<int>(before.valid),
                    static_cast<int>(after.valid), cells.size() / 8, before.min_sj, after.min_sj);
        return result.status;
    } catch (const hexopt::Failure& failure) {
        std::fprintf(stderr, "%s\n", failure.what());
        return failure.status();
    }
}
