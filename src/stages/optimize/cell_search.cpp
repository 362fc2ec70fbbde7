#include "stages/optimize/cell_search.hpp"

#include "mesh/hex_reference.hpp"
#include "stages/optimize/hex_kernels.hpp"

#include <array>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 4096;
static_assert(kChunk % kGroup == 0);

struct GroupConstants {
    std::array<float, 3 * kGroup> inverse_length;
    std::array<float, kGroup> weight;
    std::array<std::uint32_t, kGroup> mask;
    GroupConstants() {
        inverse_length.fill(1);
        weight.fill(1);
        mask.fill(~0u);
    }
    HexGroup group(const HexMesh& mesh, std::span<const Point> positions, std::size_t first) const {
        const std::size_t count = std::min<std::size_t>(kGroup, mesh.cell_count() - first);
        return {positions.data(),
                &mesh.cells[first],
                inverse_length.data(),
                weight.data(),
                mask.data(),
                static_cast<int>(count),
                1e-12};
    }
};

/// Cells for which test(group constants, first cell of the group, flags) sets a flag.
template <class Test>
std::vector<Index> find_cells(const HexMesh& mesh, const Parallel& parallel, const Test& test) {
    std::vector<std::uint8_t> found((mesh.cell_count() + kGroup - 1) / kGroup * kGroup, 0);
    parallel.for_chunks(mesh.cell_count(), kChunk, [&](std::size_t begin, std::size_t end) {
        GroupConstants constants;
        for (std::size_t c = begin; c < end; c += kGroup) test(constants, c, &found[c]);
    });
    std::vector<Index> cells;
    for (Index c = 0; c < mesh.cell_count(); ++c)
        if (found[c]) cells.push_back(c);
    return cells;
}

double mean_edge(const Cell& cell, std::span<const Point> positions) {
    double sum = 0;
    for (const auto& edge : hex::kEdgeVertex)
        sum += glm::distance(positions[cell[edge[0]]], positions[cell[edge[1]]]);
    return sum / 12;
}

} // namespace

std::vector<Index> find_bad_cells(const HexMesh& mesh, std::span<const Point> positions,
                                  const Parallel& parallel) {
    return find_cells(mesh, parallel,
                      [&](const GroupConstants& constants, std::size_t first, std::uint8_t* found) {
                          HexMeasure measure;
                          const HexGroup group = constants.group(mesh, positions, first);
                          hex_kernels().measure(group, measure);
                          for (int i = 0; i < group.count; ++i) found[i] = !(measure.min_det32[i] > 0);
                      });
}

std::vector<Index> find_poor_cells(const HexMesh& mesh, std::span<const Point> positions, double energy,
                                   const Parallel& parallel) {
    return find_cells(mesh, parallel, [&](GroupConstants& constants, std::size_t first, std::uint8_t* found) {
        const HexGroup group = constants.group(mesh, positions, first);
        for (int i = 0; i < group.count; ++i) {
            const double length = mean_edge(group.cells[i], positions);
            for (int d = 0; d < 3; ++d)
                constants.inverse_length[static_cast<std::size_t>(3 * i + d)] =
                    length > 0 ? static_cast<float>(1 / length) : 1.0f;
        }
        HexValue value;
        hex_kernels().value(group, value);
        for (int i = 0; i < group.count; ++i)
            found[i] = !(value.min_jacobian[i] > 0) || !(value.energy[i] <= 32 * energy);
    });
}

} // namespace hexopt
