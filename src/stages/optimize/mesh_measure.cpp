#include "stages/optimize/mesh_measure.hpp"

#include "stages/optimize/hex_kernels.hpp"

#include <algorithm>
#include <vector>

namespace hexopt {

namespace {

MeshMeasure combine(const MeshMeasure& a, const MeshMeasure& b) {
    return {a.bad8 + b.bad8, a.bad32 + b.bad32, std::min(a.min_sj, b.min_sj), a.sum_sj + b.sum_sj,
            a.low + b.low};
}

} // namespace

MeshMeasure measure_mesh(const HexMesh& mesh, std::span<const Point> positions, const Parallel& parallel) {
    static constexpr std::size_t kChunk = 4096;
    return parallel.reduce(
        mesh.cell_count(), kChunk, MeshMeasure{},
        [&](std::size_t begin, std::size_t end) {
            const std::vector<float> ones(kGroup, 1.0f);
            const std::vector<std::uint32_t> all(kGroup, ~0u);
            MeshMeasure sum;
            HexMeasure lanes;
            for (std::size_t c = begin; c < end; c += kGroup) {
                const int count = static_cast<int>(std::min<std::size_t>(kGroup, end - c));
                hex_kernels().measure(
                    {positions.data(), &mesh.cells[c], ones.data(), ones.data(), all.data(), count, 1},
                    lanes);
                for (int i = 0; i < count; ++i)
                    sum = combine(sum, {!(lanes.min_det8[i] > 0), !(lanes.min_det32[i] > 0), lanes.min_sj[i],
                                        lanes.min_sj[i], lanes.min_sj[i] < kLowScaledJacobian ? 1u : 0u});
            }
            return sum;
        },
        combine);
}

} // namespace hexopt
