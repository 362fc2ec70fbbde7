#include "stages/buffer/edge_uses.hpp"

namespace hexopt {

namespace {

class LeafEdges {
  public:
    LeafEdges(const std::vector<EdgeUse>& raw, const SplitTables& splits, EdgeUses& out)
        : splits_(splits), out_(out) {
        edges_.reserve(raw.size());
        for (const EdgeUse& use : raw)
            if (edges_.empty() || edges_.back() != use.edge) edges_.push_back(use.edge);
    }

    void add(const EdgeUse& use) {
        const Index a = low_of(use.edge), b = high_of(use.edge), m = splits_.middle(a, b);
        const bool first = m != kNoIndex && occurs(a, m), second = m != kNoIndex && occurs(m, b);
        if (first != second) out_.half_used.push_back(use.edge);
        if (!first || !second) {
            out_.uses.push_back(use);
            return;
        }
        add({edge_key(a, m), use.quad, use.side});
        add({edge_key(m, b), use.quad, use.side});
    }

  private:
    bool occurs(Index a, Index b) const {
        return std::binary_search(edges_.begin(), edges_.end(), edge_key(a, b));
    }

    const SplitTables& splits_;
    std::vector<EdgeKey> edges_;
    EdgeUses& out_;
};

} // namespace

std::span<const EdgeUse> EdgeUses::of(EdgeKey edge) const {
    const auto first = std::lower_bound(uses.begin(), uses.end(), EdgeUse{edge, 0, 0});
    auto last = first;
    while (last != uses.end() && last->edge == edge) ++last;
    return {first, last};
}

EdgeUses find_edge_uses(std::span<const Quad> quads, const SplitTables& splits) {
    std::vector<EdgeUse> raw;
    raw.reserve(4 * quads.size());
    for (Index q = 0; q < quads.size(); ++q)
        for (std::uint32_t s = 0; s < 4; ++s)
            raw.push_back({edge_key(quads[q][s], quads[q][(s + 1) % 4]), q, s});
    std::sort(raw.begin(), raw.end());
    EdgeUses edges;
    if (splits.middles.empty()) {
        edges.uses = std::move(raw);
        return edges;
    }
    LeafEdges leaves(raw, splits, edges);
    for (const EdgeUse& use : raw) leaves.add(use);
    std::sort(edges.uses.begin(), edges.uses.end());
    std::sort(edges.half_used.begin(), edges.half_used.end());
    return edges;
}

} // namespace hexopt
