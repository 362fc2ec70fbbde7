#pragma once

#include "stages/refine/refine.hpp"

namespace hexopt {

/// Where a run starts.
struct Start {
    HexMesh mesh;
    TargetSize surface; ///< given or chosen
};

/// The initial mesh and the surface's target size where the options leave them open. Errors (usage): a box
/// without volume, only some of the counts, a surface without extent.
Result<Start> choose_start(const Domain& domain, const RefineOptions& options);

/// Area of the surface, model units squared.
double surface_area(const Domain& domain);

} // namespace hexopt
