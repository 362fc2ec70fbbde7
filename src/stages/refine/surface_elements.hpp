#pragma once

#include "domain/box_tree.hpp"
#include "domain/clip_triangle.hpp"
#include "domain/domain.hpp"
#include "mesh/refine_cells.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// The triangles and curve segments of a domain under one numbering: triangles first.
class SurfaceElements {
  public:
    /// planar: triangles that face z and all segments are not seen by any cell.
    SurfaceElements(const Domain& domain, bool planar);

    bool is_seen(Index element) const;
    Index count() const { return triangles_ + static_cast<Index>(model_.segment_count()); }
    bool is_triangle(Index element) const { return element < triangles_; }
    Index segment_of(Index element) const { return element - triangles_; }
    /// A segment is a triangle whose last two corners are one.
    std::array<Point, 3> corners(Index element) const {
        if (is_triangle(element)) return model_.triangle(element);
        const auto& ends = model_.segment(segment_of(element));
        return {ends[0], ends[1], ends[1]};
    }
    const BoundaryModel& model() const { return model_; }

  private:
    const BoundaryModel& model_;
    Index triangles_;
    bool planar_;
};

/// Whether a triangle meets a closed box, by the thirteen axes that can separate them; the box is widened
/// by a few rounding errors, so that what touches counts. Source: separating axes, Gottschalk et al. 1996.
bool triangle_meets_box(const std::array<Point, 3>& triangle, const Box& box);

/// Bounding box of a cell of the hierarchy.
Box node_box(const CellRefinement& refinement, Index node);

/// The elements that meet the bounding boxes of cells; rows are appended as cells are cut.
struct CellElements {
    std::vector<Index> node; ///< kNoIndex: no longer of interest
    Csr<Index> elements;

    void append(Index cell, std::span<const Index> list) {
        node.push_back(cell);
        elements.item.insert(elements.item.end(), list.begin(), list.end());
        elements.offset.push_back(elements.item.size());
    }
    /// Drops the last rows, and makes the others of interest where they were: `before` is what `node` was.
    void go_back(std::vector<Index> before) {
        node = std::move(before);
        elements.offset.resize(node.size() + 1);
        elements.item.resize(elements.offset.back());
    }
};

/// Elements of every root; only roots that meet any.
CellElements find_root_elements(const CellRefinement& refinement, const SurfaceElements& surface);

/// Moves the children of rows of `from` whose node is no leaf any more to `to`, with their share of the
/// elements.
void descend(const CellRefinement& refinement, const SurfaceElements& surface, const Parallel& parallel,
             CellElements& from, CellElements& to);

} // namespace hexopt
