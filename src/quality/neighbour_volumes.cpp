#include "quality/neighbour_volumes.hpp"

#include <algorithm>
#include <cassert>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 2048;

void add_pair(NeighbourVolumes& sum, double a, double b, CellFace face) {
    ++sum.faces;
    const double smaller = std::min(a, b), larger = std::max(a, b);
    if (!(smaller > 0)) {
        ++sum.undefined;
        return;
    }
    const double ratio = larger / smaller;
    sum.mean += ratio;
    if (sum.worst.cell == kNoIndex || ratio > sum.max) {
        sum.max = ratio;
        sum.worst = face;
    }
    std::size_t bin = 0;
    // Refinement makes ratios of exactly 2, 4 and 8, but for rounding.
    for (double limit = 2; bin < 4 && ratio > limit * (1 + 1e-9); limit *= 2) ++bin;
    ++sum.histogram[bin];
}

NeighbourVolumes combine(NeighbourVolumes a, const NeighbourVolumes& b) {
    a.faces += b.faces;
    a.undefined += b.undefined;
    a.mean += b.mean;
    if (b.worst.cell != kNoIndex && (a.worst.cell == kNoIndex || b.max > a.max)) {
        a.max = b.max;
        a.worst = b.worst;
    }
    for (std::size_t i = 0; i < a.histogram.size(); ++i) a.histogram[i] += b.histogram[i];
    return a;
}

bool has_vertices(const Cell& cell, const Quad& quad) {
    return std::all_of(quad.begin(), quad.end(),
                       [&](Index v) { return std::find(cell.begin(), cell.end(), v) != cell.end(); });
}

/// Cells above `face.cell` in number that list all four vertices of the face.
template <class Visit>
void visit_later_neighbours(const HexMesh& mesh, const Topology& topology, CellFace face,
                            const Visit& visit) {
    const Quad quad = face_vertices(mesh, face);
    for (const CellCorner& candidate : topology.vertex_cell[quad[0]])
        if (candidate.cell > face.cell && has_vertices(mesh.cells[candidate.cell], quad))
            visit(candidate.cell);
}

} // namespace

NeighbourVolumes compute_neighbour_volumes(const HexMesh& mesh, const Topology& topology,
                                           std::span<const double> volume, const Parallel& parallel) {
    assert(topology.revision == mesh.revision && volume.size() == mesh.cell_count());
    NeighbourVolumes zero;
    zero.mean = 0;
    NeighbourVolumes total = parallel.reduce(
        mesh.cell_count(), kChunk, zero,
        [&](std::size_t begin, std::size_t end) {
            NeighbourVolumes part = zero;
            for (std::size_t c = begin; c < end; ++c)
                for (std::uint32_t f = 0; f < 6; ++f) {
                    const CellFace face{static_cast<Index>(c), f};
                    visit_later_neighbours(mesh, topology, face, [&](Index other) {
                        add_pair(part, volume[c], volume[other], face);
                    });
                }
            return part;
        },
        combine);
    NeighbourVolumes between_levels = zero;
    for (std::size_t i = 0; i < topology.coarse_faces.size(); ++i)
        for (const CellFace& fine : topology.fine_faces[i])
            add_pair(between_levels, volume[topology.coarse_faces[i].cell], volume[fine.cell], fine);
    total = combine(total, between_levels);
    const std::size_t defined = total.faces - total.undefined;
    total.mean = defined ? total.mean / static_cast<double>(defined) : 1;
    return total;
}

} // namespace hexopt
