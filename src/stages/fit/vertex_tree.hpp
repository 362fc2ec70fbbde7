#pragma once

#include "domain/box_tree.hpp"
#include "stages/fit/surface_mesh.hpp"

#include <glm/geometric.hpp>
#include <span>
#include <vector>

namespace hexopt::fit {

/// Vertices of the surface mesh that do not hang, by place.
class VertexTree {
  public:
    /// positions: per local vertex. queries: places that will be asked for lie in the box of these and of
    /// the vertices; elsewhere answers stay right but rounding costs time.
    VertexTree(const SurfaceMesh& surface, std::span<const Point> positions, std::span<const Point> queries);

    /// Nearest vertex, the lowest of equally near ones; kNoIndex if there is none.
    Index nearest(const Point& query) const;

    /// visit(vertex, distance) for all within `radius`, in no particular order.
    template <class Visit>
    void visit_within(const Point& query, double radius, const Visit& visit) const {
        if (member_.empty()) return;
        const double radius2 = radius * radius;
        tree_.visit_near(root_, query, radius2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i) {
                const Index v = member_[i];
                const double distance = glm::distance(positions_[v], query);
                if (distance <= radius) visit(v, distance);
            }
        });
    }

    /// Largest size of a vertex, model units.
    double largest_size() const { return largest_size_; }

  private:
    std::vector<Point> positions_;
    std::vector<Index> member_; ///< local vertices in the order of the tree's leaves
    BoxTree tree_;
    Index root_ = 0;
    double largest_size_ = 0;
};

} // namespace hexopt::fit
