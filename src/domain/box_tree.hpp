#pragma once

#include "core/types.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace hexopt {

struct Box {
    Point low = Point(std::numeric_limits<double>::infinity());
    Point high = Point(-std::numeric_limits<double>::infinity());

    void add(const Point& p) {
        for (int k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
        }
    }
    void add(const Box& box) {
        add(box.low);
        add(box.high);
    }
    Point centre() const { return 0.5 * (low + high); }
};

/// Forest of four-way trees of boxes in one array. Boxes are kept in single precision, relative to a frame
/// and rounded outwards, so that a search in double precision misses nothing.
class BoxTree {
  public:
    BoxTree() = default;
    /// frame: contains all boxes that will be added.
    explicit BoxTree(const Box& frame);

    /// Adds a tree over `boxes` (at least one) and returns its root. order[k]: which box the k-th leaf item
    /// is; leaves hold ranges of items, counted from `first_item`.
    Index add_tree(std::span<const Box> boxes, Index first_item, std::vector<Index>& order);
    /// Adds a tree whose leaves are the given trees.
    Index add_tree_of_trees(std::span<const Box> boxes, std::span<const Index> roots);

    /// Visits the leaves under `root` that may hold something at a distance of at most sqrt(best2) from
    /// query, the near ones first: visit(first_item, last_item) may lower best2 (finite, model units
    /// squared).
    template <class Visit>
    void visit_near(Index root, const Point& query, const double& best2, const Visit& visit) const {
        const std::array<float, 3> q = to_frame(query);
        const float slack = 1e-6f * (1 + std::abs(q[0]) + std::abs(q[1]) + std::abs(q[2]));
        auto bound = [&] {
            const double distance = std::min(std::sqrt(best2) * scale_, 1e18); // its square stays finite
            const float raised = static_cast<float>(distance) * 1.00001f + slack;
            return raised * raised;
        };
        float limit = bound();
        std::array<Entry, kMaxStack> stack;
        int top = 0;
        stack[top++] = {0, root, 0};
        while (top > 0) {
            const Entry entry = stack[--top];
            if (entry.distance2 > limit) continue;
            if (entry.count > 0) {
                const double before = best2;
                visit(entry.index, entry.index + entry.count);
                if (best2 < before) limit = bound();
                continue;
            }
            top = push_children(nodes_[entry.index], q, limit, stack.data(), top);
        }
    }

  private:
    static constexpr int kMaxStack = 128; ///< 3 entries a level and a root: 42 levels, two trees need 33

    using Float4 = float __attribute__((vector_size(16)));

    struct alignas(64) Node {
        std::array<Float4, 3> low, high;
        std::array<Index, 4> child;         ///< node, or first item where count is not 0
        std::array<std::uint32_t, 4> count; ///< items of a leaf; 0: inner node
    };
    struct Entry {
        float distance2;
        Index index;
        std::uint32_t count;
    };
    struct Build;

    std::array<float, 3> to_frame(const Point& p) const {
        const Point r = (p - centre_) * scale_;
        return {static_cast<float>(r.x), static_cast<float>(r.y), static_cast<float>(r.z)};
    }

    static int push_children(const Node& node, const std::array<float, 3>& q, float limit, Entry* stack,
                             int top) {
        Float4 distance2 = {};
        for (int k = 0; k < 3; ++k) {
            const Float4 below = node.low[k] - q[k], above = q[k] - node.high[k];
            Float4 d = below > above ? below : above;
            d = d > 0 ? d : Float4{};
            distance2 += d * d;
        }
        const int base = top;
        for (int c = 0; c < 4; ++c) {
            const float d2 = distance2[c];
            if (!(d2 <= limit)) continue;
            int at = top++;
            for (; at > base && stack[at - 1].distance2 < d2; --at) stack[at] = stack[at - 1];
            stack[at] = {d2, node.child[c], node.count[c]};
        }
        return top;
    }

    void set_child(Node& node, int c, const Box& box, Index child, std::uint32_t count) const;
    Index new_node();
    Index build_node(std::span<const Box> boxes, std::span<Index> order, Index first_item,
                     std::span<const Index> roots);

    std::vector<Node> nodes_;
    Point centre_ = {};
    double scale_ = 1;
};

} // namespace hexopt
