#include "stages/refine/surface_elements.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

SurfaceElements::SurfaceElements(const Domain& domain, bool planar)
    : model_(domain.model), triangles_(static_cast<Index>(domain.model.triangle_count())), planar_(planar) {}

bool SurfaceElements::is_seen(Index element) const {
    if (!planar_) return true;
    if (!is_triangle(element)) return false;
    const auto& x = model_.triangle(element);
    const Point cross = glm::cross(x[1] - x[0], x[2] - x[0]);
    return std::abs(cross.z) < 0.99 * glm::length(cross);
}

namespace {

struct CentredTriangle {
    std::array<Point, 3> corner; ///< relative to the box's centre
    Point half;                  ///< of the box, widened
};

bool separates(const CentredTriangle& t, const Point& axis) {
    const double a = glm::dot(axis, t.corner[0]), b = glm::dot(axis, t.corner[1]),
                 c = glm::dot(axis, t.corner[2]);
    const double reach = glm::dot(glm::abs(axis), t.half);
    return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
}

} // namespace

bool triangle_meets_box(const std::array<Point, 3>& triangle, const Box& box) {
    const Point centre = box.centre();
    CentredTriangle t{{triangle[0] - centre, triangle[1] - centre, triangle[2] - centre},
                      0.5 * (box.high - box.low)};
    const double reach = std::max({t.half.x, t.half.y, t.half.z});
    const Point far = glm::max(glm::abs(box.low), glm::abs(box.high));
    t.half += Point(1e-12 * reach + 4e-16 * std::max({far.x, far.y, far.z}));
    for (int d = 0; d < 3; ++d) {
        const auto [low, high] = std::minmax({t.corner[0][d], t.corner[1][d], t.corner[2][d]});
        if (low > t.half[d] || high < -t.half[d]) return false;
    }
    const std::array<Point, 3> edge = {t.corner[1] - t.corner[0], t.corner[2] - t.corner[1],
                                       t.corner[0] - t.corner[2]};
    if (separates(t, glm::cross(edge[0], edge[1]))) return false;
    for (const Point& e : edge) {
        if (separates(t, {0, -e.z, e.y}) || separates(t, {e.z, 0, -e.x}) || separates(t, {-e.y, e.x, 0}))
            return false;
    }
    return true;
}

Box node_box(const CellRefinement& refinement, Index node) {
    Box box;
    for (Index v : refinement.node(node).vertices) box.add(refinement.position(v));
    return box;
}

namespace {

/// Hands elements down a hierarchy of groups of roots.
class RootDistribution {
  public:
    RootDistribution(const CellRefinement& refinement, const SurfaceElements& surface)
        : surface_(surface), box_(refinement.root_count()), list_(refinement.root_count()) {
        std::vector<Index> roots(refinement.root_count()), elements(surface.count());
        std::iota(roots.begin(), roots.end(), Index{0});
        std::iota(elements.begin(), elements.end(), Index{0});
        for (Index root : roots) box_[root] = node_box(refinement, root);
        distribute(roots, elements);
    }

    CellElements take() {
        CellElements out;
        for (Index root = 0; root < list_.size(); ++root)
            if (!list_[root].empty()) out.append(root, list_[root]);
        return out;
    }

  private:
    void distribute(std::span<Index> roots, const std::vector<Index>& elements) {
        Box box, centres;
        for (Index root : roots) {
            box.add(box_[root]);
            centres.add(box_[root].centre());
        }
        std::vector<Index> inside;
        for (Index element : elements)
            if (surface_.is_seen(element) && triangle_meets_box(surface_.corners(element), box))
                inside.push_back(element);
        if (inside.empty()) return;
        if (roots.size() == 1) {
            list_[roots[0]] = std::move(inside);
            return;
        }
        const Point extent = centres.high - centres.low;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        const std::size_t half = roots.size() / 2;
        std::sort(roots.begin(), roots.end(), [&](Index a, Index b) {
            const double x = box_[a].centre()[axis], y = box_[b].centre()[axis];
            return x != y ? x < y : a < b;
        });
        distribute(roots.first(half), inside);
        distribute(roots.subspan(half), inside);
    }

    const SurfaceElements& surface_;
    std::vector<Box> box_;
    std::vector<std::vector<Index>> list_;
};

} // namespace

CellElements find_root_elements(const CellRefinement& refinement, const SurfaceElements& surface) {
    return RootDistribution(refinement, surface).take();
}

void descend(const CellRefinement& refinement, const SurfaceElements& surface, const Parallel& parallel,
             CellElements& from, CellElements& to) {
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < from.node.size(); ++row)
        if (from.node[row] != kNoIndex && !refinement.node(from.node[row]).is_leaf()) rows.push_back(row);
    constexpr std::size_t kChunk = 64;
    std::vector<CellElements> part((rows.size() + kChunk - 1) / kChunk);
    parallel.for_chunks(rows.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<Index> list;
        for (std::size_t i = begin; i < end; ++i) {
            const RefineNode& parent = refinement.node(from.node[rows[i]]);
            for (int c = 0; c < parent.child_count(); ++c) {
                const Index child = parent.first_child + static_cast<Index>(c);
                const Box box = node_box(refinement, child);
                list.clear();
                for (Index element : from.elements[rows[i]])
                    if (triangle_meets_box(surface.corners(element), box)) list.push_back(element);
                if (!list.empty()) part[begin / kChunk].append(child, list);
            }
        }
    });
    for (std::size_t row : rows) from.node[row] = kNoIndex;
    for (const CellElements& cells : part)
        for (std::size_t row = 0; row < cells.node.size(); ++row)
            to.append(cells.node[row], cells.elements[row]);
}

} // namespace hexopt
