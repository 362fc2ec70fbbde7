#include "stages/trim/bare_parts.hpp"

#include <algorithm>
#include <utility>

namespace hexopt::trimming {

namespace {

/// Cells with bare spots, by rising cell, and which of them touch.
class BareCells {
  public:
    BareCells(const HexMesh& mesh, const CellGraph& graph, const std::vector<BareSpot>& spots)
        : mesh_(mesh), graph_(graph) {
        for (const BareSpot& spot : spots)
            if (cells_.empty() || cells_.back() != spot.cell) cells_.push_back(spot.cell);
    }

    std::size_t count() const { return cells_.size(); }
    Index number_of(Index cell) const {
        const auto at = std::lower_bound(cells_.begin(), cells_.end(), cell);
        return at != cells_.end() && *at == cell ? static_cast<Index>(at - cells_.begin()) : kNoIndex;
    }

    /// Calls visit(cell of the octree) for every cell that touches a bare one, once for each vertex.
    template <class Visit>
    void visit_round(Index number, const Visit& visit) {
        const auto visit_star = [&](Index v) {
            graph_.gather_star(v, star_);
            for (Index c : star_) visit(c);
        };
        for (Index v : mesh_.cells[cells_[number]]) visit_star(v);
        for (Index v : graph_.cell_hanging[cells_[number]]) visit_star(v);
    }

    /// Calls visit(number) for every bare cell that touches it, once for each vertex.
    template <class Visit>
    void visit_bare(Index number, const Visit& visit) {
        visit_round(number, [&](Index c) {
            if (const Index other = number_of(c); other != kNoIndex) visit(other);
        });
    }

  private:
    const HexMesh& mesh_;
    const CellGraph& graph_;
    std::vector<Index> cells_, star_;
};

/// Part of each bare cell; they are numbered by their first cells.
std::vector<Index> number_parts(BareCells& bare) {
    std::vector<Index> part(bare.count(), kNoIndex), queue;
    Index parts = 0;
    for (Index seed = 0; seed < part.size(); ++seed) {
        if (part[seed] != kNoIndex) continue;
        queue.assign(1, seed);
        part[seed] = parts;
        for (std::size_t i = 0; i < queue.size(); ++i)
            bare.visit_bare(queue[i], [&](Index other) {
                if (std::exchange(part[other], parts) == kNoIndex) queue.push_back(other);
            });
        ++parts;
    }
    return part;
}

/// Per bare cell: how many others are between it and the kept ones; or the first of its part where that
/// touches none.
std::vector<Index> measure_depth(BareCells& bare, const KeptCells& kept) {
    std::vector<Index> depth(bare.count(), kNoIndex), queue;
    for (Index i = 0; i < depth.size(); ++i) {
        bool beside = false;
        bare.visit_round(i, [&](Index c) { beside = beside || kept.is_kept(c); });
        if (!beside) continue;
        depth[i] = 0;
        queue.push_back(i);
    }
    std::size_t done = 0;
    const auto spread = [&] {
        for (; done < queue.size(); ++done)
            bare.visit_bare(queue[done], [&](Index other) {
                if (depth[other] != kNoIndex) return;
                depth[other] = depth[queue[done]] + 1;
                queue.push_back(other);
            });
    };
    spread();
    for (Index i = 0; i < depth.size(); ++i) {
        if (depth[i] != kNoIndex) continue;
        depth[i] = 0;
        queue.push_back(i);
        spread();
    }
    return depth;
}

} // namespace

std::vector<BarePart> join_bare_spots(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                                      std::vector<BareSpot>& spots) {
    BareCells bare(mesh, graph, spots);
    const std::vector<Index> part = number_parts(bare), depth = measure_depth(bare, kept);
    std::vector<BarePart> parts;
    for (BareSpot& spot : spots) {
        const Index i = bare.number_of(spot.cell);
        spot.part = part[i];
        if (parts.size() <= spot.part) parts.resize(spot.part + std::size_t{1});
        BarePart& whole = parts[spot.part];
        whole.area += spot.area;
        whole.depth = std::max(whole.depth, depth[i]);
    }
    return parts;
}

} // namespace hexopt::trimming
