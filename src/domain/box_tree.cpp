#include "domain/box_tree.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

constexpr std::size_t kLeafSize = 4;
constexpr float kPad = 5e-7f; // several units in the last place of a coordinate in [-1, 1]

Box box_of(std::span<const Box> boxes, std::span<const Index> order) {
    Box box;
    for (Index i : order) box.add(boxes[i]);
    return box;
}

/// Splits in two halves across the longest extent of the boxes' centres; ties by number keep it
/// deterministic.
std::size_t split(std::span<const Box> boxes, std::span<Index> order) {
    Box centres;
    for (Index i : order) centres.add(boxes[i].centre());
    const Point extent = centres.high - centres.low;
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (extent[k] > extent[axis]) axis = k;
    const std::size_t middle = order.size() / 2;
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                     [&](Index a, Index b) {
                         const double ca = boxes[a].low[axis] + boxes[a].high[axis];
                         const double cb = boxes[b].low[axis] + boxes[b].high[axis];
                         return ca != cb ? ca < cb : a < b;
                     });
    return middle;
}

} // namespace

BoxTree::BoxTree(const Box& frame) : centre_(frame.centre()) {
    const double half = 0.5 * glm::length(frame.high - frame.low);
    scale_ = half > 0 ? 1 / half : 1;
}

Index BoxTree::new_node() {
    Node node;
    for (int k = 0; k < 3; ++k) {
        node.low[k] = Float4{} + std::numeric_limits<float>::infinity();
        node.high[k] = -node.low[k];
    }
    node.child.fill(kNoIndex);
    node.count.fill(0);
    nodes_.push_back(node);
    return static_cast<Index>(nodes_.size() - 1);
}

void BoxTree::set_child(Node& node, int c, const Box& box, Index child, std::uint32_t count) const {
    const std::array<float, 3> low = to_frame(box.low), high = to_frame(box.high);
    for (int k = 0; k < 3; ++k) {
        node.low[k][c] = low[k] - kPad;
        node.high[k][c] = high[k] + kPad;
    }
    node.child[c] = child;
    node.count[c] = count;
}

Index BoxTree::build_node(std::span<const Box> boxes, std::span<Index> order, Index first_item,
                          std::span<const Index> roots) {
    const Index self = new_node();
    std::array<std::size_t, 5> cut = {0, 0, 0, 0, order.size()};
    cut[2] = order.size() <= 1 ? order.size() : split(boxes, order);
    cut[1] = cut[2] <= 1 ? cut[2] : split(boxes, order.first(cut[2]));
    cut[3] =
        cut[2] + (order.size() - cut[2] <= 1 ? order.size() - cut[2] : split(boxes, order.subspan(cut[2])));
    for (int c = 0; c < 4; ++c) {
        const std::span<Index> part = order.subspan(cut[c], cut[c + 1] - cut[c]);
        if (part.empty()) continue;
        const Box box = box_of(boxes, part);
        const Index begin = first_item + static_cast<Index>(cut[c]);
        if (!roots.empty() && part.size() == 1) {
            set_child(nodes_[self], c, box, roots[part[0]], 0);
        } else if (roots.empty() && part.size() <= kLeafSize) {
            set_child(nodes_[self], c, box, begin, static_cast<std::uint32_t>(part.size()));
        } else {
            const Index child = build_node(boxes, part, begin, roots);
            set_child(nodes_[self], c, box, child, 0);
        }
    }
    return self;
}

Index BoxTree::add_tree(std::span<const Box> boxes, Index first_item, std::vector<Index>& order) {
    order.resize(boxes.size());
    std::iota(order.begin(), order.end(), Index{0});
    return build_node(boxes, order, first_item, {});
}

Index BoxTree::add_tree_of_trees(std::span<const Box> boxes, std::span<const Index> roots) {
    std::vector<Index> order(boxes.size());
    std::iota(order.begin(), order.end(), Index{0});
    return build_node(boxes, order, 0, roots);
}

} // namespace hexopt
