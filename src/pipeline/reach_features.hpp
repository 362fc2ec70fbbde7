#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "domain/fitted_mesh.hpp"
#include "mesh/topology.hpp"

#include <limits>
#include <vector>

namespace hexopt {

struct ReachFeaturesOptions {
    double min_sj = 0.2; ///< cells may become worse than they are down to this, -1..1
    /// Places on the surface that are no corners of the domain and get a vertex too where cells allow it,
    /// which stays bound to what it is bound to: corners of features that were given up.
    std::vector<Point> more_places;
    double time_limit_s = std::numeric_limits<double>::infinity();
};

/// Before and after reach_features().
struct ReachReport {
    std::size_t corners = 0;                           ///< of the domain
    std::size_t corners_before = 0, corners_after = 0; ///< of these with a boundary vertex on them
    /// Length of the mesh edges that follow curves and lie with both ends on them, fraction of that of all
    /// curves.
    double followed_before_rel = 1, followed_after_rel = 1;
    std::size_t off_before = 0, off_after = 0; ///< boundary vertices off what they are bound to
};

/// Brings a settled mesh closer to its features (HomeReacher): first vertices that are off their corners,
/// then those off their curves; then for each corner that no vertex is on the nearest one that may get there
/// on its patch or curve, which is bound to it then; last those off their patches, and missed corners
/// again. Corners and patches get as many tries as a share of the cells allows. domain is bound to `fitted`,
/// also afterwards. Errors: cancelled, the mesh is sound.
Result<ReachReport> reach_features(FittedMesh& fitted, const Topology& topology, Domain& domain,
                                   const ReachFeaturesOptions& options, Context& context);

} // namespace hexopt
