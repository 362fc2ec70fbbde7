#include "mesh/remap.hpp"

#include <algorithm>
#include <numeric>

namespace hexopt {

namespace {

std::vector<Index> identity(std::size_t count) {
    std::vector<Index> order(count);
    std::iota(order.begin(), order.end(), Index{0});
    return order;
}

std::vector<Index> chain(const std::vector<Index>& first, const std::vector<Index>& second) {
    std::vector<Index> both(first.size());
    std::transform(first.begin(), first.end(), both.begin(),
                   [&](Index i) { return i == kNoIndex ? kNoIndex : second[i]; });
    return both;
}

Hanging remap_hanging(const Hanging& old, const std::vector<Index>& old2new) {
    std::vector<Index> rows;
    for (Index row = 0; row < old.count(); ++row)
        if (old2new[old.vertex[row]] != kNoIndex) rows.push_back(row);
    std::sort(rows.begin(), rows.end(),
              [&](Index a, Index b) { return old2new[old.vertex[a]] < old2new[old.vertex[b]]; });
    Hanging renumbered;
    std::vector<std::pair<Index, double>> terms;
    for (Index row : rows) {
        terms.clear();
        for (std::size_t k = old.offset[row]; k < old.offset[row + 1]; ++k) {
            assert(old2new[old.master[k]] != kNoIndex);
            terms.emplace_back(old2new[old.master[k]], old.weight[k]);
        }
        std::sort(terms.begin(), terms.end());
        renumbered.vertex.push_back(old2new[old.vertex[row]]);
        for (auto [master, weight] : terms) {
            renumbered.master.push_back(master);
            renumbered.weight.push_back(weight);
        }
        renumbered.offset.push_back(renumbered.master.size());
    }
    return renumbered;
}

template <std::size_t N>
bool keeps_all(const std::array<Index, N>& vertices, const std::vector<Index>& old2new) {
    return std::all_of(vertices.begin(), vertices.end(), [&](Index v) { return old2new[v] != kNoIndex; });
}

} // namespace

Remap identity_remap(const HexMesh& mesh) {
    return {identity(mesh.vertex_count()), identity(mesh.cell_count()), mesh.vertex_count(),
            mesh.cell_count()};
}

std::vector<Index> invert_order(std::span<const Index> new2old, std::size_t old_count) {
    std::vector<Index> old2new(old_count, kNoIndex);
    for (Index i = 0; i < new2old.size(); ++i) old2new[new2old[i]] = i;
    return old2new;
}

Remap invert(const Remap& remap) {
    assert(remap.vertex_old2new.size() == remap.vertex_count &&
           remap.cell_old2new.size() == remap.cell_count);
    return {invert_order(remap.vertex_old2new, remap.vertex_count),
            invert_order(remap.cell_old2new, remap.cell_count), remap.vertex_count, remap.cell_count};
}

Remap compose(const Remap& first, const Remap& second) {
    return {chain(first.vertex_old2new, second.vertex_old2new),
            chain(first.cell_old2new, second.cell_old2new), second.vertex_count, second.cell_count};
}

HexMesh apply_remap(const HexMesh& mesh, const Remap& remap) {
    HexMesh renumbered;
    renumbered.revision = mesh.revision + 1;
    renumbered.patch_names = mesh.patch_names;
    renumbered.positions = remap_values<Point>(mesh.positions, remap.vertex_old2new, remap.vertex_count);
    renumbered.cells = remap_values<Cell>(mesh.cells, remap.cell_old2new, remap.cell_count);
    for (Cell& cell : renumbered.cells) {
        assert(keeps_all(cell, remap.vertex_old2new));
        for (Index& v : cell) v = remap.vertex_old2new[v];
    }
    if (!mesh.level.empty())
        renumbered.level = remap_values<std::uint8_t>(mesh.level, remap.cell_old2new, remap.cell_count);
    renumbered.hanging = remap_hanging(mesh.hanging, remap.vertex_old2new);
    for (BoundaryQuad quad : mesh.boundary) {
        if (!keeps_all(quad.vertices, remap.vertex_old2new)) continue;
        for (Index& v : quad.vertices) v = remap.vertex_old2new[v];
        renumbered.boundary.push_back(quad);
    }
    return renumbered;
}

} // namespace hexopt
