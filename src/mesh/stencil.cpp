#include "mesh/stencil.hpp"

#include <algorithm>
#include <cassert>
#include <map>

namespace hexopt {

namespace {

/// The free vertices that a cell depends on, each with the weights of the cell's corners.
class CellMasters {
  public:
    struct Master {
        Index vertex;
        CornerWeights weights;
    };

    CellMasters(const HexMesh& mesh, const std::vector<Index>& hanging_row)
        : mesh_(mesh), hanging_row_(hanging_row) {}

    bool has_hanging(const Cell& cell) const {
        return std::any_of(cell.begin(), cell.end(), [&](Index v) { return hanging_row_[v] != kNoIndex; });
    }

    const std::vector<Master>& gather(const Cell& cell) {
        masters_.clear();
        const Hanging& h = mesh_.hanging;
        for (int k = 0; k < 8; ++k) {
            const Index row = hanging_row_[cell[k]];
            if (row == kNoIndex)
                add(cell[k], k, 1);
            else
                for (std::size_t i = h.offset[row]; i < h.offset[row + 1]; ++i)
                    add(h.master[i], k, h.weight[i]);
        }
        return masters_;
    }

  private:
    void add(Index vertex, int corner, double weight) {
        auto at = std::find_if(masters_.begin(), masters_.end(),
                               [&](const Master& m) { return m.vertex == vertex; });
        if (at == masters_.end()) at = masters_.insert(at, {vertex, CornerWeights{}});
        at->weights[corner] += weight;
    }

    const HexMesh& mesh_;
    const std::vector<Index>& hanging_row_;
    std::vector<Master> masters_;
};

class PatternTable {
  public:
    PatternTable() {
        for (int k = 0; k < 8; ++k) {
            CornerWeights unit{};
            unit[k] = 1;
            number(unit);
        }
    }
    std::uint32_t number(const CornerWeights& weights) {
        const auto [it, is_new] = numbers_.try_emplace(weights, static_cast<std::uint32_t>(patterns_.size()));
        if (is_new) patterns_.push_back(weights);
        return it->second;
    }
    std::vector<CornerWeights> take() { return std::move(patterns_); }

  private:
    std::map<CornerWeights, std::uint32_t> numbers_;
    std::vector<CornerWeights> patterns_;
};

} // namespace

Stencils compute_stencils(const HexMesh& mesh, const Topology& topology) {
    assert(topology.revision == mesh.revision);
    Stencils stencils;
    stencils.revision = mesh.revision;
    PatternTable table;
    if (mesh.hanging.empty()) {
        stencils.conforming = &topology.vertex_cell;
        stencils.patterns = table.take();
        return stencils;
    }
    Csr<BallEntry>& ball = stencils.own;
    ball.offset.assign(mesh.vertex_count() + 1, 0);
    CellMasters masters(mesh, topology.hanging_row);
    for (const Cell& cell : mesh.cells)
        if (masters.has_hanging(cell))
            for (const auto& master : masters.gather(cell)) ++ball.offset[master.vertex];
        else
            for (Index v : cell) ++ball.offset[v];
    std::size_t end = 0;
    for (std::size_t& offset : ball.offset) offset = end += offset;
    ball.item.resize(end);
    // Filling from the last cell backwards turns the ends of the rows into their starts.
    for (Index c = static_cast<Index>(mesh.cell_count()); c-- > 0;) {
        const Cell& cell = mesh.cells[c];
        if (masters.has_hanging(cell))
            for (const auto& master : masters.gather(cell))
                ball.item[--ball.offset[master.vertex]] = {c, table.number(master.weights)};
        else
            for (std::uint32_t k = 0; k < 8; ++k) ball.item[--ball.offset[cell[k]]] = {c, k};
    }
    stencils.patterns = table.take();
    return stencils;
}

} // namespace hexopt
