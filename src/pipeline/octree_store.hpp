#pragma once

#include "core/context.hpp"
#include "stages/refine/refine_history.hpp"

#include <variant>

namespace hexopt {

/// The octree of a run, which only its repairs need once it has been meshed: till then it may be put away as
/// its splits, less than a byte a leaf, and is made again, the same, when it is asked for.
class OctreeStore {
  public:
    explicit OctreeStore(RefineOutput octree);

    /// The octree, which may be changed; made again where it was put away.
    RefineOutput& open(Context& context);
    void put_away();
    bool is_put_away() const { return std::holds_alternative<RefineHistory>(octree_); }

    /// Leaves.
    std::size_t cell_count() const;
    const RefineStats& stats() const;
    RefineHistory history() const;

  private:
    std::variant<RefineOutput, RefineHistory> octree_;
    std::size_t leaves_ = 0; ///< of an octree that is put away
};

} // namespace hexopt
