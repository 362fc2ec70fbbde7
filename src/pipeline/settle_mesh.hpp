#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/topology.hpp"
#include "stages/optimize/optimize.hpp"
#include "stages/optimize/retreat.hpp"

#include <optional>
#include <vector>

namespace hexopt {

/// A boundary vertex that was let off what it is bound to.
struct BackedOffVertex {
    Index vertex;
    EntityKind kind; ///< what it is bound to
    Point position;
    double distance; ///< from there, model units
};

struct SettleReport {
    /// How far the farthest of them is, relative to the diagonal; 0: all are on what they are bound to.
    double deviation_rel = 0;
    std::size_t backed_off_count = 0;        ///< vertices farther off than rounding
    std::vector<BackedOffVertex> backed_off; ///< the farthest 20 of them, the farthest first
    RetreatReport retreat;                   ///< what sliding alone left bad, and what was done about it
};

/// What the steps of settle_mesh() came to, taken beforehand.
struct SettleTrial {
    std::vector<Point> positions; ///< after the last of them
    RetreatReport retreat;
    std::optional<OptimizeStats> raised; ///< of raise_settled(); none: not taken yet
};

/// Makes a mesh valid that was optimized on the surface and features that its vertices are bound to: where
/// cells are bad or the boundary touches itself, goes back to where it was before fitting and comes home from
/// there as far as all cells stay valid (retreat()); raises the worst cells at the end. unfitted:
/// FittedMesh::unfitted, may be empty. options.max_deviation_rel: the farthest that a vertex may end from
/// what it is bound to. `stats`: of the run before; sums up this one too. Errors: those of optimize();
/// cancelled leaves in `mesh` the best state so far. trial: of the same mesh and options; null: none.
Status settle_mesh(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                   std::span<const Point> unfitted, const OptimizeOptions& options, OptimizeStats& stats,
                   SettleReport& report, Context& context, const SettleTrial* trial = nullptr);

/// Lists the vertices that are off what they are bound to in `report`, in place of those listed before.
void find_backed_off(const HexMesh& mesh, const BoundaryModel& surface, SettleReport& report);

} // namespace hexopt
