#pragma once

#include "core/csr.hpp"
#include "core/types.hpp"

#include <span>

namespace hexopt::trimming {

inline constexpr double kUnknownThickness = -1;

/// The surface of about one direction in a cell.
struct SurfaceSide {
    Point direction; ///< unit
    Point centre;
    Point at; ///< centroid of the largest piece of a triangle
    double area;
    Index patch;      ///< of that piece
    double thickness; ///< behind the surface; 0 where no cells are wanted there
};

/// Sides of the surface in the cells that it cuts, by the cells' keys.
class SurfaceSides {
  public:
    bool knows(Index key) const { return key < row_.size() && row_[key] != kNoIndex; }
    /// Makes room for so many more, no more than that.
    void reserve(std::size_t cells, std::size_t sides) {
        sides_.offset.reserve(sides_.offset.size() + cells);
        sides_.item.reserve(sides_.item.size() + sides);
    }
    void add(Index key, std::span<const SurfaceSide> sides) {
        if (row_.size() <= key) row_.resize(key + std::size_t{1}, kNoIndex);
        row_[key] = static_cast<Index>(sides_.rows());
        sides_.item.insert(sides_.item.end(), sides.begin(), sides.end());
        sides_.offset.push_back(sides_.item.size());
    }
    /// Of a cell that is known.
    std::span<SurfaceSide> in_cell(Index key) {
        const std::size_t first = sides_.offset[row_[key]], last = sides_.offset[row_[key] + 1];
        return {sides_.item.data() + first, last - first};
    }

  private:
    std::vector<Index> row_; ///< by key
    Csr<SurfaceSide> sides_;
};

} // namespace hexopt::trimming
