#include "stages/refine/refine_history.hpp"

namespace hexopt {

RefineHistory make_history(const RefineOutput& refined) {
    RefineHistory history{refined.refinement.roots(),
                          {},
                          {},
                          refined.stats,
                          refined.mask,
                          refined.max_cells,
                          refined.finest_size,
                          refined.octree.revision};
    for (const RefineRequest& split : refined.refinement.splits()) {
        history.split_node.push_back(split.node);
        history.split_mask.push_back(split.mask);
    }
    return history;
}

Result<RefineOutput> replay_history(RefineHistory history, Context& context) {
    if (history.split_node.size() != history.split_mask.size() || history.mask == 0 ||
        history.mask > kAllAxes)
        return make_error(ErrorCode::bad_input, "refine", "",
                          "the history of the refinement does not fit together");
    std::vector<RefineRequest> splits;
    splits.reserve(history.split_node.size());
    for (std::size_t i = 0; i < history.split_node.size(); ++i)
        splits.push_back({history.split_node[i], history.split_mask[i]});
    auto refinement = CellRefinement::replay(std::move(history.roots), splits, context.parallel());
    if (!refinement) return refinement.error();
    LeafMesh leaves = refinement->leaf_mesh(context.parallel());
    leaves.mesh.revision = history.revision;
    return RefineOutput{std::move(*refinement),        std::move(leaves.mesh), std::move(leaves.leaf_node),
                        std::move(history.stats),      history.mask,           history.max_cells,
                        std::move(history.finest_size)};
}

} // namespace hexopt
