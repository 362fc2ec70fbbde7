#include "pipeline/octree_store.hpp"

#include <cassert>
#include <utility>

namespace hexopt {

OctreeStore::OctreeStore(RefineOutput octree) : octree_(std::move(octree)) {}

RefineOutput& OctreeStore::open(Context& context) {
    if (auto* history = std::get_if<RefineHistory>(&octree_)) {
        auto octree = replay_history(std::move(*history), context);
        assert(octree.has_value()); // its own history
        octree_ = std::move(octree).value();
    }
    return std::get<RefineOutput>(octree_);
}

void OctreeStore::put_away() {
    if (is_put_away()) return;
    leaves_ = cell_count();
    octree_ = history();
}

std::size_t OctreeStore::cell_count() const {
    const auto* octree = std::get_if<RefineOutput>(&octree_);
    return octree ? octree->octree.cell_count() : leaves_;
}

const RefineStats& OctreeStore::stats() const {
    const auto* octree = std::get_if<RefineOutput>(&octree_);
    return octree ? octree->stats : std::get<RefineHistory>(octree_).stats;
}

RefineHistory OctreeStore::history() const {
    const auto* octree = std::get_if<RefineOutput>(&octree_);
    return octree ? make_history(*octree) : std::get<RefineHistory>(octree_);
}

} // namespace hexopt
