#pragma once

#include "stages/optimize/budget.hpp"

namespace hexopt {

/// The thesis's method: Algorithm 3 with the printed loop counts over Algorithms 1 (local untangling) and 2
/// (local optimization), boundary fixed. What may be chosen and where it departs from the print:
/// docs/thesis-method.md. Works on `positions` of the mesh; may end worse than it began (optimize() keeps the
/// best). Fills what it did into stats.
void optimize_thesis(const HexMesh& mesh, const Topology& topology, const OptimizeOptions& options,
                     std::vector<Point>& positions, Budget& budget,
                     const std::function<void()>& keep_if_better, OptimizeStats& stats);

} // namespace hexopt
