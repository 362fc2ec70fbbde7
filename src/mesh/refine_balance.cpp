#include "mesh/refine_cells.hpp"

#include <algorithm>

namespace hexopt {

/// Which leaves a call splits, where every split has the same mask.
struct CellRefinement::Marks {
    enum : std::uint8_t { none, split, source };
    std::vector<std::uint8_t> marked;         ///< per node
    std::vector<std::uint8_t> rings;          ///< per vertex: rings of cells that still have to follow
    std::vector<std::vector<Index>> by_level; ///< leaves
};

/// One ring further: leaves of `level` hand on what is left of `reach`, coarser ones are marked, too, but for
/// sources that are spared.
void CellRefinement::spread_ring(const std::vector<Index>& leaves, int level, int reach, bool spare,
                                 Marks& marks) const {
    for (Index leaf : leaves) {
        const RefineNode& node = nodes_[leaf];
        int rings = 0;
        for (Index v : node.vertices) rings = std::max<int>(rings, marks.rings[v]);
        if (rings != reach) continue;
        const bool coarser = node.depth() < level;
        if (coarser && !(spare && marks.marked[leaf] == Marks::source)) marks.marked[leaf] = Marks::split;
        const int left = reach - (coarser ? 2 : 1);
        for (Index v : node.vertices)
            marks.rings[v] = static_cast<std::uint8_t>(std::max<int>(marks.rings[v], left));
    }
}

/// Marks the leaves of level - 1 within `rings` cells of the leaves of `level` that are marked `kind`.
void CellRefinement::spread_marks(int level, int rings, std::uint8_t kind, Marks& marks) const {
    bool any = false;
    for (Index leaf : marks.by_level[level]) {
        if (marks.marked[leaf] != kind) continue;
        if (!any) marks.rings.assign(positions_.size(), 0);
        any = true;
        for (Index v : nodes_[leaf].vertices) marks.rings[v] = static_cast<std::uint8_t>(rings);
    }
    const bool spare = kind == Marks::source;
    for (int left = rings; any && left > 0; --left) {
        spread_ring(marks.by_level[level - 1], level, left, spare, marks);
        if (left > 1) spread_ring(marks.by_level[level], level, left, spare, marks);
    }
}

/// The leaves to split, coarse ones first. A leaf of level k that is split needs neighbours of level k or
/// finer; in a balanced mesh the coarser ones are of level k - 1 and share a vertex with it.
std::vector<Index> CellRefinement::mark_uniform(std::span<const RefineRequest> requests, int rings,
                                                std::span<const Index> sources, int layers,
                                                RefineCount& count) const {
    Marks marks;
    marks.marked.assign(nodes_.size(), Marks::none);
    for (Index leaf : sources) marks.marked[leaf] = Marks::source;
    for (const RefineRequest& request : requests) {
        count.requested += marks.marked[request.node] != Marks::split;
        marks.marked[request.node] = Marks::split;
    }
    for (Index n = 0; n < nodes_.size(); ++n) {
        if (!nodes_[n].is_leaf()) continue;
        if (marks.by_level.size() <= nodes_[n].depth()) marks.by_level.resize(nodes_[n].depth() + 1u);
        marks.by_level[nodes_[n].depth()].push_back(n);
    }
    for (int level = static_cast<int>(marks.by_level.size()) - 1; level > 0; --level) {
        spread_marks(level, std::clamp(rings, 1, 250), Marks::split, marks);
        if (!sources.empty()) spread_marks(level, std::clamp(layers, 1, 250), Marks::source, marks);
    }
    std::vector<Index> split;
    for (const std::vector<Index>& leaves : marks.by_level)
        for (Index leaf : leaves)
            if (marks.marked[leaf] == Marks::split) split.push_back(leaf);
    count.balance += split.size() - count.requested;
    return split;
}

/// A leaf that touches another one: the axes along which the two share an edge or face.
struct CellRefinement::Contact {
    Index leaf;
    std::array<int, 3> axis; ///< per axis of the first leaf: the other's, -1 where they share none
    int shared = 0;          ///< axes: 2 a face, 1 an edge, 0 a vertex
};

void CellRefinement::find_touching(Index root, const RootLattice::Range& range, std::vector<Index>& stack,
                                   std::vector<Index>& found) const {
    stack.assign(1, root);
    while (!stack.empty()) {
        const Index n = stack.back();
        stack.pop_back();
        const RefineNode& node = nodes_[n];
        bool touches = true;
        for (int d = 0; d < 3; ++d) {
            const std::uint32_t high = node.low[d] + (lattice_.size() >> node.level[d]);
            touches = touches && node.low[d] <= range.high[d] && range.low[d] <= high;
        }
        if (!touches) continue;
        if (node.is_leaf()) {
            found.push_back(n);
            continue;
        }
        for (int c = node.child_count(); c-- > 0;) stack.push_back(node.first_child + static_cast<Index>(c));
    }
}

void CellRefinement::find_contacts(Index n, std::vector<Contact>& contacts) const {
    contacts.clear();
    const RefineNode& node = nodes_[n];
    RootLattice::Range box{node.low, node.low};
    for (int d = 0; d < 3; ++d) box.high[d] += lattice_.size() >> node.level[d];
    std::vector<RootLattice::Image> images = {{node.root, box, {0, 1, 2}}};
    lattice_.append_images(node.root, box, images);
    std::vector<Index> stack, found;
    for (const RootLattice::Image& image : images) {
        found.clear();
        find_touching(image.root, image.range, stack, found);
        for (Index other : found) {
            if (other == n) continue;
            Contact contact{other, {-1, -1, -1}};
            for (int d = 0; d < 3; ++d) {
                const int to = image.axis[d];
                if (to < 0) continue;
                const std::uint32_t low = nodes_[other].low[to];
                const std::uint32_t high = low + (lattice_.size() >> nodes_[other].level[to]);
                if (std::max(low, image.range.low[to]) >= std::min(high, image.range.high[to])) continue;
                contact.axis[d] = to;
                ++contact.shared;
            }
            contacts.push_back(contact);
        }
    }
}

namespace {

struct PairMasks {
    AxisMask first = 0, second = 0;
};

AxisMask bit(int axis) { return static_cast<AxisMask>(1 << axis); }

/// What two leaves that touch must be split along. axis: as Contact::axis.
PairMasks compare_levels(const RefineNode& a, const RefineNode& b, const std::array<int, 3>& axis, int shared,
                         bool first_yields) {
    PairMasks masks;
    const int least_a = *std::min_element(a.level.begin(), a.level.end());
    const int least_b = *std::min_element(b.level.begin(), b.level.end());
    AxisMask finer_a = 0, finer_b = 0; // along shared axes, a's numbering
    for (int d = 0; d < 3; ++d) {
        if (a.level[d] + 1 < least_b) masks.first |= bit(d);
        if (b.level[d] + 1 < least_a) masks.second |= bit(d);
        if (axis[d] < 0) continue;
        const int difference = a.level[d] - b.level[axis[d]];
        if (difference > 1) masks.second |= bit(axis[d]);
        if (difference < -1) masks.first |= bit(d);
        if (difference > 0) finer_a |= bit(d);
        if (difference < 0) finer_b |= bit(d);
    }
    if (shared != 2 || finer_a == 0 || finer_b == 0) return masks;
    // Neither face contains the other: the one that yields is cut where the other is finer.
    for (int d = 0; d < 3; ++d) {
        if (first_yields && (finer_b >> d & 1)) masks.first |= bit(d);
        if (!first_yields && (finer_a >> d & 1)) masks.second |= bit(axis[d]);
    }
    return masks;
}

} // namespace

void CellRefinement::refine_mixed(std::span<const RefineRequest> requests, RefineCount& count) {
    if (!lattice_.is_connected()) lattice_.connect(root_mesh_);
    std::vector<AxisMask> wanted(nodes_.size(), 0);
    std::vector<Index> order;
    for (const RefineRequest& request : requests) {
        if (wanted[request.node] == 0) order.push_back(request.node);
        wanted[request.node] |= request.mask;
    }
    count.requested += order.size();
    std::vector<Index> open; // leaves whose neighbours have to be looked at
    const auto cut = [&](Index n, AxisMask mask) {
        split(n, mask);
        for (int c = nodes_[n].child_count(); c-- > 0;)
            open.push_back(nodes_[n].first_child + static_cast<Index>(c));
    };
    for (auto it = order.rbegin(); it != order.rend(); ++it) cut(*it, wanted[*it]);
    std::vector<Contact> contacts;
    while (!open.empty()) {
        const Index n = open.back();
        open.pop_back();
        if (!nodes_[n].is_leaf()) continue;
        find_contacts(n, contacts);
        for (const Contact& contact : contacts) {
            const Index other = contact.leaf;
            if (!nodes_[other].is_leaf()) continue;
            const PairMasks masks =
                compare_levels(nodes_[n], nodes_[other], contact.axis, contact.shared, n < other);
            count.balance += (masks.first != 0) + (masks.second != 0);
            if (masks.second != 0) cut(other, masks.second);
            if (masks.first == 0) continue;
            cut(n, masks.first);
            break;
        }
    }
}

} // namespace hexopt
