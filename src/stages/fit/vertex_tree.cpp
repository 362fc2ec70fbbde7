#include "stages/fit/vertex_tree.hpp"

#include <algorithm>
#include <limits>

namespace hexopt::fit {

VertexTree::VertexTree(const SurfaceMesh& surface, std::span<const Point> positions,
                       std::span<const Point> queries)
    : positions_(positions.begin(), positions.end()) {
    Box frame;
    std::vector<Box> boxes;
    std::vector<Index> vertex, order;
    for (Index v = 0; v < positions_.size(); ++v) {
        if (surface.hanging[v]) continue;
        boxes.emplace_back().add(positions_[v]);
        frame.add(positions_[v]);
        vertex.push_back(v);
        largest_size_ = std::max(largest_size_, surface.size[v]);
    }
    if (boxes.empty()) return;
    for (const Point& p : queries) frame.add(p);
    tree_ = BoxTree(frame);
    root_ = tree_.add_tree(boxes, 0, order);
    for (Index i : order) member_.push_back(vertex[i]);
}

Index VertexTree::nearest(const Point& query) const {
    if (member_.empty()) return kNoIndex;
    Index best = member_.front();
    const Point to_first = positions_[best] - query;
    double best2 = glm::dot(to_first, to_first);
    tree_.visit_near(root_, query, best2, [&](Index first, Index last) {
        for (Index i = first; i < last; ++i) {
            const Index v = member_[i];
            const Point d = positions_[v] - query;
            const double d2 = glm::dot(d, d);
            if (d2 < best2 || (d2 == best2 && v < best)) {
                best2 = d2;
                best = v;
            }
        }
    });
    return best;
}

} // namespace hexopt::fit
