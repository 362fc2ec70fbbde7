#pragma once

#include "core/context.hpp"
#include "domain/domain.hpp"
#include "domain/fitted_mesh.hpp"

namespace hexopt {

struct InflateOptions {
    int surface_sweeps = 20; ///< of the boundary on its patches and curves; >= 0
    int volume_sweeps = 10;  ///< of the vertices inside, near the boundary; >= 0
    int rings = 4;           ///< of cells from the boundary whose vertices move; >= 1
};

/// Spreads freshly inserted layers by Laplacian smoothing (thesis 3.5): boundary vertices on what they are
/// bound to, then those inside within some rings of cells. Corners stay. A start for optimize(), not a
/// result: cells may end inverted. Jacobi sweeps: same bits for any number of threads. Errors: cancelled.
Status inflate_layers(FittedMesh& fitted, const Domain& domain, const InflateOptions& options,
                      Context& context);

} // namespace hexopt
