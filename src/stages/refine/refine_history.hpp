#pragma once

#include "stages/refine/refine.hpp"

namespace hexopt {

/// What a RefineOutput can be made from again: the initial mesh and the splits in their order.
struct RefineHistory {
    HexMesh roots;
    std::vector<Index> split_node;
    std::vector<AxisMask> split_mask; ///< per split
    RefineStats stats;
    AxisMask mask = kAllAxes;
    std::size_t max_cells = 0;
    std::vector<double> finest_size;
    std::uint64_t revision = 0; ///< of the octree
};

RefineHistory make_history(const RefineOutput& refined);

/// The output that the history is of: the same cells, vertices and numbers, and the same when it is refined
/// further. Errors (bad_input): a history that cannot be.
Result<RefineOutput> replay_history(RefineHistory history, Context& context);

} // namespace hexopt
