#pragma once

#include "stages/optimize/device_problem.hpp"

#include <optional>

namespace hexopt {

/// A block of 2 x 2 x 2 cells round a vertex, as a kernel takes it: 27 vertices, x + 3 y + 9 z, the vertex
/// itself in the middle, and 8 cells of the problem by octant, x + 2 y + 4 z with 1 where a direction is
/// negative.
struct RegularBlock {
    static constexpr std::size_t kNumbers = 35;
    std::array<std::uint32_t, 27> vertex;
    std::array<std::uint32_t, 8> cell;
};

/// The block round a dof, or nothing where its ball is another one or something hangs on it.
std::optional<RegularBlock> find_regular_block(const Problem& problem, const DofBalls& balls, Index dof);

} // namespace hexopt
