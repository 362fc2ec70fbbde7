#pragma once

#include "stages/buffer/sheet_mesh.hpp"

namespace hexopt {

/// One side of a quad along an edge. Where a set of quads holds a coarse edge and both its halves, the coarse
/// quad counts on the halves.
struct EdgeUse {
    EdgeKey edge;
    Index quad;         ///< place in the list
    std::uint32_t side; ///< from vertex `side` of the quad to the next
    auto operator<=>(const EdgeUse&) const = default;
};

struct EdgeUses {
    std::vector<EdgeUse> uses;      ///< sorted
    std::vector<EdgeKey> half_used; ///< coarse edges of which one half only is in the set; sorted

    std::span<const EdgeUse> of(EdgeKey edge) const;
};

/// Sides of the quads by edge.
EdgeUses find_edge_uses(std::span<const Quad> quads, const SplitTables& splits);

/// Calls visit(first, last) for the uses of each edge in turn.
template <class Visit>
void for_each_edge(const EdgeUses& edges, const Visit& visit) {
    for (std::size_t i = 0; i < edges.uses.size();) {
        std::size_t end = i + 1;
        while (end < edges.uses.size() && edges.uses[end].edge == edges.uses[i].edge) ++end;
        visit(std::span<const EdgeUse>(edges.uses.data() + i, end - i));
        i = end;
    }
}

} // namespace hexopt
