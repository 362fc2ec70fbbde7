#pragma once

#include "stages/buffer/sheet_mesh.hpp"

namespace hexopt {

/// Spreads what sheets have squeezed together: `sweeps` damped Laplacian steps of the vertices from
/// `first_new` on and of those within `rings` edges of them. Interior vertices follow all their edges, those
/// on a patch or curve the ones along it, and are projected back; corners stay, hanging vertices follow their
/// parents. A step that makes a cell worse than before and than a scaled Jacobian of 0.3 is not taken. Same
/// bits for any number of threads. Source: thesis 3.5 (inflation).
void relax_layers(SheetMesh& mesh, std::size_t first_new, int sweeps, int rings, const BoundaryModel& model,
                  const Parallel& parallel);

} // namespace hexopt
