#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "stages/planar/quad_quality.hpp"

#include <limits>

namespace hexopt {

struct RelaxOptions {
    int sweeps = 100;         ///< at most, over the vertices that still move; 1..1,000,000
    double still = 1e-3;      ///< vertices that move by less, in cell sizes, rest until a neighbour moves
    bool max_min = true;      ///< raise the worst quads at the end
    double raise_below = 0.5; ///< scaled Jacobian of quads that are raised
    double time_limit_s = std::numeric_limits<double>::infinity();
};

struct RelaxReport {
    QuadQuality before, after;
    int sweeps = 0;
    std::size_t moves = 0; ///< of single vertices
    bool out_of_time = false;
};

/// Improves the shape of the quads by moving free vertices and sliding those on outlines, corners and
/// topology as they are: regularised shape energy by damped Newton steps colour by colour, with growing
/// powers, then the worst quads one by one. Starts from vertices near the walls; what does not move is left
/// out. Same bits for any number of threads. Error: cancelled (the mesh is the best state so far, with as few
/// inverted quads as there were).
Result<RelaxReport> relax_quads(QuadMesh& mesh, const OutlineCurves& curves, const RelaxOptions& options,
                                Context& context);

} // namespace hexopt
