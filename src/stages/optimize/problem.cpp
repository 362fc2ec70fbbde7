#include "stages/optimize/problem.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

constexpr std::size_t kOrderChunk = 4096;

/// Bit v set where tetrahedron t uses vertex v.
constexpr std::array<std::uint8_t, 32> kTetVertexBits = [] {
    std::array<std::uint8_t, 32> bits{};
    for (int t = 0; t < 32; ++t)
        for (int d = 0; d < 3; ++d)
            for (int end = 0; end < 2; ++end)
                bits[t] =
                    static_cast<std::uint8_t>(bits[t] | 1u << hex::kEdgeVertex[hex::kTetEdge[t][d]][end]);
    return bits;
}();

/// By key(cell), which is below `keys`; cells of one key stay in their order.
template <class Key>
std::vector<Index> sort_by_key(const std::vector<Index>& cells, const Key& key, std::size_t keys,
                               const Parallel& parallel) {
    std::vector<Index> key_of(cells.size());
    std::vector<std::size_t> next(keys + 1, 0);
    parallel.for_each(cells.size(), kOrderChunk, [&](std::size_t i) { key_of[i] = key(cells[i]); });
    for (Index k : key_of) ++next[k + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<Index> sorted(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) sorted[next[key_of[i]]++] = cells[i];
    return sorted;
}

} // namespace

Problem::Problem(const HexMesh& mesh, const Topology& topology, std::span<const std::uint8_t> movable,
                 std::uint32_t tets, std::span<const float> inverse_stretch, const Parallel& parallel)
    : mesh_(&mesh), inverse_stretch_(inverse_stretch) {
    auto numbers = std::make_shared<Numbers>();
    number_dofs(topology, movable, *numbers);
    make_shares(topology, *numbers);
    numbers_ = std::move(numbers);
    collect_cells(topology);
    order_cells(tets, parallel);
    set_weights();
}

/// Breadth-first over the cells: neighbours in space end up near each other whatever the input's numbering.
void Problem::number_dofs(const Topology& topology, std::span<const std::uint8_t> movable, Numbers& numbers) {
    const auto is_dof = [&](Index v) {
        return movable[v] && (topology.hanging_row.empty() || topology.hanging_row[v] == kNoIndex);
    };
    numbers.vertex_dof.assign(mesh_->vertex_count(), kNoIndex);
    std::vector<std::uint8_t> seen(mesh_->vertex_count(), 0);
    std::vector<Index> queue;
    for (Index seed = 0; seed < mesh_->vertex_count(); ++seed) {
        if (!is_dof(seed) || seen[seed]) continue;
        seen[seed] = 1;
        queue.assign(1, seed);
        for (std::size_t head = 0; head < queue.size(); ++head) {
            const Index v = queue[head];
            if (is_dof(v)) {
                numbers.vertex_dof[v] = static_cast<Index>(dof_vertex_.size());
                add_dof(v);
            }
            for (CellCorner corner : topology.vertex_cell[v])
                for (Index w : mesh_->cells[corner.cell])
                    if (!seen[w] && movable[w]) seen[w] = 1, queue.push_back(w);
        }
    }
    dof_vertex_.shrink_to_fit();
    self_share_.shrink_to_fit();
}

void Problem::add_dof(Index vertex) {
    self_share_.push_back({static_cast<Index>(dof_vertex_.size()), 1.0f});
    dof_vertex_.push_back(vertex);
}

void Problem::make_shares(const Topology& topology, Numbers& numbers) {
    const Hanging& hanging = mesh_->hanging;
    if (hanging.empty()) return;
    numbers.hanging_row = topology.hanging_row;
    Csr<DofShare>& shares = numbers.hanging_share;
    for (std::size_t row = 0; row < hanging.count(); ++row) {
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
            if (const Index dof = numbers.vertex_dof[hanging.master[k]]; dof != kNoIndex)
                shares.item.push_back({dof, static_cast<float>(hanging.weight[k])});
        if (shares.item.size() > shares.offset.back()) hanging_rows_.push_back(static_cast<Index>(row));
        shares.offset.push_back(shares.item.size());
    }
}

void Problem::collect_cells(const Topology& topology) {
    std::vector<std::uint8_t> active(mesh_->cell_count(), 0);
    for (Index v : dof_vertex_)
        for (CellCorner corner : topology.vertex_cell[v]) active[corner.cell] = 1;
    for (Index row : hanging_rows_)
        for (CellCorner corner : topology.vertex_cell[mesh_->hanging.vertex[row]]) active[corner.cell] = 1;
    for (Index c = 0; c < mesh_->cell_count(); ++c)
        if (active[c]) cell_id_.push_back(c);
}

void Problem::order_cells(std::uint32_t tets, const Parallel& parallel) {
    const auto lowest_dof = [&](Index c) {
        Index lowest = kNoIndex;
        for (Index v : mesh_->cells[c])
            for (DofShare share : shares(v)) lowest = std::min(lowest, share.dof);
        return lowest;
    };
    cell_id_ = sort_by_key(cell_id_, lowest_dof, dof_count(), parallel);
    const std::size_t cells = cell_id_.size();
    if (has_hanging()) cell_hanging_.assign(cells, 0);
    cell_dof_.offset.assign(cells + 1, 0);
    tet_mask_.assign(cells, 0);
    std::vector<std::vector<Index>> found((cells + kOrderChunk - 1) / kOrderChunk);
    parallel.for_chunks(cells, kOrderChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<Index>& list = found[begin / kOrderChunk];
        list.reserve(8 * (end - begin));
        for (std::size_t i = begin; i < end; ++i) {
            const auto first = static_cast<std::ptrdiff_t>(list.size());
            collect_dofs(i, list);
            std::sort(list.begin() + first, list.end());
            list.erase(std::unique(list.begin() + first, list.end()), list.end());
            cell_dof_.offset[i + 1] = list.size() - static_cast<std::size_t>(first);
            tet_mask_[i] = moving_tets(i) & tets;
        }
    });
    std::partial_sum(cell_dof_.offset.begin(), cell_dof_.offset.end(), cell_dof_.offset.begin());
    cell_dof_.item.resize(cell_dof_.offset.back());
    parallel.for_each(found.size(), 1, [&](std::size_t chunk) {
        std::copy(found[chunk].begin(), found[chunk].end(),
                  cell_dof_.item.begin() +
                      static_cast<std::ptrdiff_t>(cell_dof_.offset[chunk * kOrderChunk]));
    });
}

/// Appends the dofs that a cell's corners depend on, as they come, and notes whether one hangs.
void Problem::collect_dofs(std::size_t i, std::vector<Index>& dofs) {
    for (Index v : cell(i)) {
        const auto list = shares(v);
        for (DofShare share : list) dofs.push_back(share.dof);
        if (!list.empty() && vertex_dof(v) == kNoIndex) cell_hanging_[i] = 1;
    }
}

/// The tetrahedra of a cell that have a corner that moves.
std::uint32_t Problem::moving_tets(std::size_t i) const {
    std::uint32_t free_bits = 0, mask = 0;
    for (int k = 0; k < 8; ++k)
        if (!shares(cell(i)[k]).empty()) free_bits |= 1u << k;
    for (int t = 0; t < 32; ++t)
        if (kTetVertexBits[t] & free_bits) mask |= 1u << t;
    return mask;
}

void Problem::set_weights() {
    // Across levels a cell counts by V_target^(2/3), or the many fine cells distort the coarse side.
    weight_.assign(cell_count(), 1.0f);
    inverse_length_.assign(cell_count(), 1.0f);
    if (mesh_->hanging.empty() || mesh_->level.empty()) return;
    for (std::size_t i = 0; i < cell_count(); ++i)
        weight_[i] = std::ldexp(1.0f, -2 * static_cast<int>(mesh_->level[cell_id_[i]]));
}

void Problem::apply_hanging(std::span<Point> positions, std::span<const Index> rows) const {
    const Hanging& hanging = mesh_->hanging;
    for (Index row : rows) {
        Point sum(0);
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
            sum += hanging.weight[k] * positions[hanging.master[k]];
        positions[hanging.vertex[row]] = sum;
    }
}

void Problem::update_lengths(std::span<const Point> positions, const Parallel& parallel) {
    const auto mean_edge = [&](std::size_t i) {
        const Cell& vertices = cell(i);
        double sum = 0;
        for (std::size_t e = 0; e < 12; ++e) {
            const auto& edge = hex::kEdgeVertex[e];
            const double length = glm::distance(positions[vertices[edge[0]]], positions[vertices[edge[1]]]);
            sum += inverse_stretch_.empty() ? length
                                            : length * inverse_stretch_[3 * std::size_t{cell_id_[i]} + e / 4];
        }
        return sum / 12;
    };
    const double total = parallel.reduce(
        cell_count(), 4096, 0.0,
        [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) {
                const double length = mean_edge(i);
                inverse_length_[i] = static_cast<float>(length);
                sum += length;
            }
            return sum;
        },
        std::plus<>());
    const float floor =
        static_cast<float>(1e-3 * total / static_cast<double>(std::max<std::size_t>(1, cell_count())));
    parallel.for_each(cell_count(), 4096, [&](std::size_t i) {
        inverse_length_[i] = 1.0f / std::max(inverse_length_[i], floor);
    });
}

std::vector<Problem> Problem::split(Problem whole) {
    UnionFind sets = find_dof_parts(whole);
    std::vector<Problem> parts;
    std::vector<Index> part_of(whole.dof_count()), local(whole.dof_count());
    for (Index d = 0; d < whole.dof_count(); ++d) {
        const Index root = sets.find(d);
        if (root == d) {
            part_of[d] = static_cast<Index>(parts.size());
            Problem& part = parts.emplace_back(Problem());
            part.mesh_ = whole.mesh_;
            part.inverse_stretch_ = whole.inverse_stretch_;
        }
        part_of[d] = part_of[root];
        local[d] = static_cast<Index>(parts[part_of[d]].dof_count());
        parts[part_of[d]].add_dof(whole.dof_vertex_[d]);
    }
    if (parts.size() == 1) {
        parts.front() = std::move(whole);
        return parts;
    }
    for (std::size_t c = 0; c < whole.cell_count(); ++c) {
        const auto dofs = whole.cell_dof_[c];
        Problem& part = parts[part_of[dofs.front()]];
        part.cell_id_.push_back(whole.cell_id_[c]);
        part.tet_mask_.push_back(whole.tet_mask_[c]);
        part.weight_.push_back(whole.weight_[c]);
        part.inverse_length_.push_back(whole.inverse_length_[c]);
        if (!whole.cell_hanging_.empty()) part.cell_hanging_.push_back(whole.cell_hanging_[c]);
        for (Index d : dofs) part.cell_dof_.item.push_back(local[d]);
        part.cell_dof_.offset.push_back(part.cell_dof_.item.size());
    }
    auto numbers = std::make_shared<Numbers>(*whole.numbers_);
    for (Index row : whole.hanging_rows_) {
        parts[part_of[numbers->hanging_share[row].front().dof]].hanging_rows_.push_back(row);
    }
    for (DofShare& share : numbers->hanging_share.item) share.dof = local[share.dof];
    for (Index d = 0; d < whole.dof_count(); ++d) numbers->vertex_dof[whole.dof_vertex_[d]] = local[d];
    for (Problem& part : parts) part.numbers_ = numbers;
    return parts;
}

UnionFind find_dof_parts(const Problem& problem) {
    UnionFind parts(problem.dof_count());
    for (std::size_t c = 0; c < problem.cell_count(); ++c) {
        Index first = kNoIndex;
        for (Index v : problem.cell(c))
            for (DofShare share : problem.shares(v)) {
                if (first == kNoIndex) first = share.dof;
                parts.join(first, share.dof);
            }
    }
    return parts;
}

} // namespace hexopt
