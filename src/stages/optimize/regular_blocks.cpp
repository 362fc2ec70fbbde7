#include "stages/optimize/regular_blocks.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>

namespace hexopt {

namespace {

/// A cell of the ball, turned so that the dof's vertex is its corner (0, 0, 0): vertices by x + 2 y + 4 z.
std::array<Index, 8> turned(const Cell& cell, std::uint32_t corner) {
    const std::uint32_t cx = (corner ^ corner >> 1) & 1, cy = corner >> 1 & 1, cz = corner >> 2;
    const bool odd = (cx ^ cy ^ cz) == 1;
    std::array<Index, 8> vertices{};
    for (std::uint32_t place = 0; place < 8; ++place) {
        const std::uint32_t x = place & 1, y = place >> 1 & 1, z = place >> 2;
        const std::uint32_t ax = (odd ? y : x) ^ cx, ay = (odd ? x : y) ^ cy, az = z ^ cz;
        vertices[place] = cell[(ax ^ ay) + 2 * ay + 4 * az];
    }
    return vertices;
}

/// Directions of the block: 2 axis + (1 where negative).
class Directions {
  public:
    explicit Directions(const std::array<Index, 8>& first) : vertex_{} {
        vertex_.fill(kNoIndex);
        for (int axis = 0; axis < 3; ++axis) vertex_[2 * axis] = first[std::size_t{1} << axis];
    }

    /// Direction of a neighbour; -1 while unknown.
    int find(Index neighbour) const {
        const auto at = std::find(vertex_.begin(), vertex_.end(), neighbour);
        return at == vertex_.end() ? -1 : static_cast<int>(at - vertex_.begin());
    }

    /// Directions of a cell's three neighbours. Where one of them is new, it lies opposite to the known one
    /// along the axis that is left. False: not yet clear, or no block.
    bool place(const std::array<Index, 8>& cell, std::array<int, 3>& direction) {
        int unknown = -1, axes = 0;
        for (int k = 0; k < 3; ++k) {
            direction[k] = find(cell[std::size_t{1} << k]);
            if (direction[k] < 0) {
                if (unknown >= 0) return false;
                unknown = k;
            } else {
                axes |= 1 << (direction[k] / 2);
            }
        }
        if (unknown < 0) return axes == 7;
        const int axis = axes == 6 ? 0 : axes == 5 ? 1 : axes == 3 ? 2 : -1;
        if (axis < 0 || vertex_[2 * axis + 1] != kNoIndex) return false;
        vertex_[2 * axis + 1] = cell[std::size_t{1} << unknown];
        direction[unknown] = 2 * axis + 1;
        return true;
    }

  private:
    std::array<Index, 6> vertex_;
};

/// Enters a cell whose three directions are known; false where it contradicts what is there.
bool enter(const std::array<Index, 8>& cell, const std::array<int, 3>& direction, std::uint32_t number,
           RegularBlock& block) {
    std::uint32_t octant = 0;
    for (int d : direction) octant |= static_cast<std::uint32_t>(d % 2) << (d / 2);
    if (block.cell[octant] != kNoIndex) return false;
    block.cell[octant] = number;
    constexpr int kStride[3] = {1, 3, 9};
    for (std::uint32_t place = 0; place < 8; ++place) {
        int at = 13;
        for (int k = 0; k < 3; ++k)
            if (place >> k & 1) at += (direction[k] % 2 ? -1 : 1) * kStride[direction[k] / 2];
        std::uint32_t& vertex = block.vertex[static_cast<std::size_t>(at)];
        if (vertex != kNoIndex && vertex != cell[place]) return false;
        vertex = cell[place];
    }
    return true;
}

} // namespace

std::optional<RegularBlock> find_regular_block(const Problem& problem, const DofBalls& balls, Index dof) {
    const std::uint32_t first = balls.offset[dof];
    if (balls.offset[dof + 1] - first != 8) return std::nullopt;
    std::array<std::array<Index, 8>, 8> cells;
    for (std::uint32_t i = 0; i < 8; ++i) {
        const std::uint32_t row = balls.item[2 * (first + i) + 1];
        if (row >= 8) return std::nullopt;
        cells[i] = turned(problem.cell(balls.item[2 * (first + i)]), row);
    }
    RegularBlock block;
    block.vertex.fill(kNoIndex);
    block.cell.fill(kNoIndex);
    Directions directions(cells[0]);
    std::array<bool, 8> entered{};
    for (int left = 8; left > 0;) {
        const int before = left;
        for (std::uint32_t i = 0; i < 8; ++i) {
            std::array<int, 3> direction{};
            if (entered[i] || !directions.place(cells[i], direction)) continue;
            if (!enter(cells[i], direction, balls.item[2 * (first + i)], block)) return std::nullopt;
            entered[i] = true;
            --left;
        }
        if (left == before) return std::nullopt;
    }
    return block;
}

} // namespace hexopt
