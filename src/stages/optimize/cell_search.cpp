#include "stages/optimize/cell_search.hpp"

#include "mesh/hex_reference.hpp"
#include "stages/optimize/hex_kernels.hpp"

#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 4096;
static_assert(kChunk % kGroup == 0);

struct GroupConstants {
    std::array<float, kGroup> inverse_length;
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

/// Over the stretch, if there is one.
double mean_edge(const Cell& cell, std::span<const Point> positions, const float* inverse_stretch) {
    double sum = 0;
    for (std::size_t e = 0; e < 12; ++e) {
        const auto& edge = hex::kEdgeVertex[e];
        sum += glm::distance(positions[cell[edge[0]]], positions[cell[edge[1]]]) *
               (inverse_stretch ? inverse_stretch[e / 4] : 1);
    }
    return sum / 12;
}

} // namespace

namespace {

/// Cells whose measure `fails(measure, lane)`.
template <class Fails>
std::vector<Index> find_measured(const HexMesh& mesh, std::span<const Point> positions,
                                 const Parallel& parallel, const Fails& fails) {
    return find_cells(mesh, parallel,
                      [&](const GroupConstants& constants, std::size_t first, std::uint8_t* found) {
                          HexMeasure measure;
                          const HexGroup group = constants.group(mesh, positions, first);
                          hex_kernels().measure(group, measure);
                          for (int i = 0; i < group.count; ++i) found[i] = fails(measure, i);
                      });
}

} // namespace

std::vector<Index> find_bad_cells(const HexMesh& mesh, std::span<const Point> positions,
                                  const Parallel& parallel) {
    return find_measured(mesh, positions, parallel,
                         [](const HexMeasure& measure, int i) { return !(measure.min_det32[i] > 0); });
}

std::vector<Index> find_flat_cells(const HexMesh& mesh, std::span<const Point> positions, double min_sj,
                                   const Parallel& parallel) {
    return find_measured(mesh, positions, parallel, [&](const HexMeasure& measure, int i) {
        return !(measure.min_det32[i] > 0) || !(measure.min_sj[i] >= min_sj);
    });
}

namespace {

/// Energies of the cells first.. of a group, each against its own mean edge and stretch.
int measure_energy(GroupConstants& constants, const HexMesh& mesh, std::span<const Point> positions,
                   std::span<const float> inverse_stretch, std::size_t first, HexValue& value) {
    HexGroup group = constants.group(mesh, positions, first);
    if (!inverse_stretch.empty()) group.inverse_stretch = &inverse_stretch[3 * first];
    for (int i = 0; i < group.count; ++i) {
        const double length = mean_edge(group.cells[i], positions,
                                        group.inverse_stretch ? group.inverse_stretch + 3 * i : nullptr);
        constants.inverse_length[static_cast<std::size_t>(i)] =
            length > 0 ? static_cast<float>(1 / length) : 1.0f;
    }
    hex_kernels().value(group, value);
    return group.count;
}

} // namespace

std::vector<Index> find_poor_cells(const HexMesh& mesh, std::span<const Point> positions,
                                   std::span<const float> inverse_stretch, double energy,
                                   const Parallel& parallel) {
    return find_cells(mesh, parallel, [&](GroupConstants& constants, std::size_t first, std::uint8_t* found) {
        HexValue value;
        const int count = measure_energy(constants, mesh, positions, inverse_stretch, first, value);
        for (int i = 0; i < count; ++i)
            found[i] = !(value.min_jacobian[i] > 0) || !(value.energy[i] <= 32 * energy);
    });
}

double sum_of_energy(const HexMesh& mesh, std::span<const Point> positions,
                     std::span<const float> inverse_stretch, const Parallel& parallel) {
    return parallel.reduce(
        mesh.cell_count(), kChunk, 0.0,
        [&](std::size_t begin, std::size_t end) {
            GroupConstants constants;
            HexValue value;
            double sum = 0;
            for (std::size_t c = begin; c < end; c += kGroup) {
                const int count = measure_energy(constants, mesh, positions, inverse_stretch, c, value);
                for (int i = 0; i < count; ++i) sum += value.energy[i] / 32;
            }
            return sum;
        },
        std::plus<>());
}

std::vector<float> inverse_stretches(std::span<const std::array<double, 3>> lengths) {
    std::vector<float> inverse;
    inverse.reserve(3 * lengths.size());
    for (const auto& l : lengths) {
        const double mean = std::cbrt(l[0]) * std::cbrt(l[1]) * std::cbrt(l[2]);
        for (double length : l) inverse.push_back(static_cast<float>(mean / length));
    }
    return inverse;
}

} // namespace hexopt
