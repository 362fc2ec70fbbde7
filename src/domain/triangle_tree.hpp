#pragma once

#include "domain/box_tree.hpp"

#include <array>
#include <glm/geometric.hpp>
#include <span>
#include <vector>

namespace hexopt {

/// Bounding-box tree over triangles that also sums their solid angles. Immutable; queries are thread-safe.
class TriangleTree {
  public:
    using Corners = std::array<Point, 3>;

    /// Corners of each triangle, finite. An empty list is allowed: nothing is ever visited.
    explicit TriangleTree(std::span<const Corners> triangles);

    std::size_t count() const { return corners_.size(); }
    /// Of all triangles; empty without any.
    Box box() const { return nodes_.empty() ? Box{} : nodes_[0].box; }

    /// Generalised winding number at p: solid angle of all triangles over 4 pi, 1 inside a closed outward
    /// oriented surface, 0 outside, in between where it has holes. Clusters of triangles farther than `beta`
    /// times their radius are taken as one dipole; infinity is exact. Source: Jacobson, Kavan,
    /// Sorkine-Hornung 2013; Barill et al. 2018 (Fast winding numbers for soups and clouds).
    double winding_number(const Point& p, double beta) const;

    /// visit(triangle, corners) -> bool for every triangle whose bounding box touches `box`, in a fixed
    /// order, until it returns true. Returns whether one did.
    template <class Visit>
    bool visit_box(const Box& box, const Visit& visit) const {
        return walk([&](const Node& node) { return overlap(node.box, box); },
                    [&](Index item) {
                        Box own;
                        for (const Point& x : corners_[item]) own.add(x);
                        return overlap(own, box) && visit(triangle_[item], corners_[item]);
                    });
    }

    /// visit(triangle, t, leaving) for every triangle that the line from `from` along `direction` meets at
    /// from + t * direction with low <= t <= high; lines in a triangle's plane are left out. leaving: the
    /// line goes from behind the counter-clockwise side to before it.
    template <class Visit>
    void visit_line(const Point& from, const Point& direction, double low, double high,
                    const Visit& visit) const {
        const Point inverse = 1.0 / direction;
        walk([&](const Node& node) { return meets(node.box, from, inverse, low, high); },
             [&](Index item) {
                 double t;
                 bool leaving;
                 if (intersect(corners_[item], from, direction, t, leaving) && t >= low && t <= high)
                     visit(triangle_[item], t, leaving);
                 return false;
             });
    }

  private:
    struct Node {
        Box box;
        Point centre; ///< mean of the triangles' centroids by area
        Point dipole; ///< sum of their vector areas
        double radius2;
        Index right; ///< node of the second half; the first follows its parent. Leaf: first item
        Index count; ///< items of a leaf, 0 for inner nodes
    };
    static constexpr std::size_t kLeafSize = 4;
    static constexpr int kMaxStack = 64;

    static bool overlap(const Box& a, const Box& b) {
        return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
               a.low.z <= b.high.z && b.low.z <= a.high.z;
    }
    static bool meets(const Box& box, const Point& from, const Point& inverse, double low, double high);
    static bool intersect(const Corners& x, const Point& from, const Point& direction, double& t,
                          bool& leaving);

    template <class Enter, class Leaf>
    bool walk(const Enter& enter, const Leaf& leaf) const {
        std::array<Index, kMaxStack> stack;
        int top = 0;
        if (!nodes_.empty()) stack[top++] = 0;
        while (top > 0) {
            const Index n = stack[--top];
            const Node& node = nodes_[n];
            if (!enter(node)) continue;
            if (node.count == 0) {
                stack[top++] = node.right;
                stack[top++] = n + 1;
                continue;
            }
            for (Index item = node.right; item < node.right + node.count; ++item)
                if (leaf(item)) return true;
        }
        return false;
    }

    struct Build;

    std::vector<Node> nodes_;
    std::vector<Corners> corners_;
    std::vector<Index> triangle_; ///< per item: its number in the list given
};

/// Solid angle of a triangle seen from p over 4 pi, positive from behind its counter-clockwise side; 0 in its
/// plane. Source: van Oosterom, Strackee 1983.
double triangle_winding(const TriangleTree::Corners& x, const Point& p);

} // namespace hexopt
