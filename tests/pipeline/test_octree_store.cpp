#include "pipeline/octree_store.hpp"

#include "domain/domain.hpp"
#include "samples/geometry/solid.hpp"
#include "stages/refine/refine.hpp"

#include <catch2/catch.hpp>

namespace hexopt {

TEST_CASE("an octree that was put away is the same again, also when it is refined further") {
    Context context(1);
    auto domain =
        build_domain(geometry::make_box(Point(0), Point(2), {"a", "b", "c", "d", "e", "f"}), {}, context);
    REQUIRE(domain);
    RefineOptions options;
    options.surface.size = 0.25;
    auto refined = refine(*domain, options, context);
    REQUIRE(refined);
    RefineOutput kept = *refined;
    OctreeStore store(std::move(*refined));
    CHECK_FALSE(store.is_put_away());
    for (Index round = 0; round < 3; ++round) {
        const std::vector<Index> cells = {5 + round, 40 + round};
        store.put_away();
        CHECK(store.is_put_away());
        CHECK(store.cell_count() == kept.octree.cell_count());
        CHECK(store.stats().level_cells == kept.stats.level_cells);
        CHECK(store.history().split_node == make_history(kept).split_node);
        RefineOutput& made = store.open(context);
        CHECK_FALSE(store.is_put_away());
        CHECK(made.octree.positions == kept.octree.positions);
        CHECK(made.octree.cells == kept.octree.cells);
        CHECK(made.octree.hanging.master == kept.octree.hanging.master);
        CHECK(made.octree.revision == kept.octree.revision);
        CHECK(made.leaf_node == kept.leaf_node);
        CHECK(made.max_cells == kept.max_cells);
        CHECK(made.finest_size == kept.finest_size);
        CHECK(refine_cells(made, cells, context).requested == refine_cells(kept, cells, context).requested);
        CHECK(store.cell_count() == kept.octree.cell_count());
    }
}

} // namespace hexopt
