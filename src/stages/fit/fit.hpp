#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "domain/fitted_mesh.hpp"
#include "stages/fit/capture.hpp"
#include "stages/fit/fairing.hpp"
#include "stages/fit/regions.hpp"

#include <vector>

namespace hexopt {

struct FitOptions {
    fit::FairingOptions fairing;
    fit::CaptureOptions capture;
    int surface_sweeps = 20; ///< Laplacian sweeps of the surface on its patches, at the end
};

struct FitReport {
    std::size_t corners = 0, curves = 0; ///< of the domain
    std::size_t captured_corners = 0, captured_curves = 0;
    int reroutes = 0; ///< paths dropped to let another one through
    struct ReleasedCurve {
        Index curve;
        fit::Release reason;
    };
    std::vector<ReleasedCurve> released_curves; ///< not followed as a whole
    double curve_length = 0,
           followed_length = 0;  ///< of all curves and of the parts that mesh edges follow, model units
    double largest_distance = 0; ///< of a boundary vertex to its target before it moved, model units
};

struct FitOutput {
    FittedMesh fitted;               ///< boundary vertices on their targets, the interior where it was
    std::vector<Index> refine_cells; ///< cells round what could not be captured, rising
    FitReport report;
};

/// Fits the boundary of a trimmed mesh to the domain: fairing and projection, corners, curves, patches
/// (thesis section 3.5). Connectivity stays. Errors: cancelled.
Result<FitOutput> fit_boundary(HexMesh trimmed, const Domain& domain, const FitOptions& options,
                               Context& context);

} // namespace hexopt
