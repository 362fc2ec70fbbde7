#pragma once

#include "domain/split_curves.hpp"
#include "pipeline/mesh_attempt.hpp"
#include "pipeline/mesh_surface.hpp"
#include "pipeline/octree_store.hpp"

#include <optional>
#include <vector>

namespace hexopt {

/// How far a run has come.
enum class MeshPhase : std::uint8_t {
    refined,   ///< the octree is ready for attempt number `round`
    fitted,    ///< `current` is to be optimized
    attempted, ///< `best` is to be settled
    settled,   ///< `best` is
};
/// "refined", ...
const char* name_of(MeshPhase phase);

/// A run between two of its stages: all that the rest of it hangs on but for the domain and the options.
struct MeshState {
    explicit MeshState(RefineOutput output) : octree(std::move(output)), first_cells(octree.cell_count()) {}

    /// Whether the octree may be refined in so many cells: repairs end where it would grow beyond three times
    /// its first size.
    bool may_refine(std::size_t cells) const { return octree.cell_count() + 7 * cells <= 3 * first_cells; }

    MeshPhase phase = MeshPhase::refined;
    OctreeStore octree;
    std::size_t first_cells;            ///< of the octree that the first attempt began with
    int round = 0;                      ///< attempts before this one; planar: repairs
    int joins = 0;                      ///< planar: times that cells were refined to join parts
    AttemptCounts counts;               ///< its memory of trims only saves time
    std::vector<AttemptCount> attempts; ///< that have ended
    std::vector<CurveCut> cuts;         ///< of the domain's curves, made for good before the first attempt
    std::vector<Index> narrow;          ///< curves after that which no attempt follows; rising
    std::vector<Index> dropped; ///< curves of the domain that the attempt under way goes without; rising
    std::optional<MeshAttempt> current; ///< under way
    std::optional<MeshAttempt> best;    ///< of those that have ended; after settling the settled mesh
    SettleReport settle;
};

} // namespace hexopt
