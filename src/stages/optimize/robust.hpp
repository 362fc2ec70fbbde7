#pragma once

#include "stages/optimize/minimiser.hpp"

namespace hexopt {

/// The default method: harmonic start and regularised untangling with the boundary fixed, then sliding, then
/// bands off the surface where allowed and needed, then max-min. Works on `positions` of the mesh; may end
/// worse than it began (optimize() keeps the best). The engine computes; what is decided, and the guards, are
/// the same for all. Fills what it did into stats.
void optimize_robust(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                     const OptimizeOptions& options, Engine& engine, std::vector<Point>& positions,
                     Budget& budget, const std::function<void()>& keep_if_better, OptimizeStats& stats);

} // namespace hexopt
