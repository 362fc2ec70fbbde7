#pragma once

#include "domain/boundary_model.hpp"
#include "stages/optimize/optimize.hpp"

#include <limits>

namespace hexopt {

struct RetreatOptions {
    /// Where the vertices would be had the boundary not been fitted (FittedMesh::unfitted); empty: where they
    /// are.
    std::span<const Point> unfitted;
    /// Farthest that a vertex may end from what it is bound to, model units; >= 0. What cannot keep to it is
    /// left as it was.
    double max_deviation = std::numeric_limits<double>::infinity();
    double time_limit_s = std::numeric_limits<double>::infinity(); ///< > 0
};

/// All zero where nothing was wrong.
struct RetreatReport {
    std::size_t bad_before = 0, bad_after = 0; ///< cells with a non-positive one of all 32 tetrahedra
    std::size_t touching_before = 0, touching_after = 0; ///< boundary quads in contact with others
    int attempts = 0;
    std::size_t moved = 0;      ///< vertices that the last attempt moved
    std::size_t beyond_max = 0; ///< vertices that would have had to go farther than max_deviation
};

/// Makes a fitted mesh valid where sliding could not, undoes contacts of its boundary with itself, and gets
/// valid cells with a scaled Jacobian below 0.01 out of there. The
/// neighbourhoods of what is bad go back to where they were before fitting, which is near the sound staircase
/// of boxes that trimming left; there the layers are untangled with the boundary free but drawn to its place.
/// From that valid state the boundary is drawn to what it is bound to, under a barrier that keeps all cells
/// valid; corners, then curves, then patches come to lie on it exactly as soon as their cells allow, and what
/// would touch is held back. Neighbourhoods that are too small to become valid grow, to 16 rings.
/// Never more bad cells and touching quads together than before. The boundary slides on `surface`, which is
/// bound to the mesh. Cost: in proportion to the neighbourhoods, 300-700 us a cell of the mesh where they are
/// most of it; time_limit_s bounds it. Source: barrier and regularised energy of optimize(); the way back and
/// forth is this project's.
RetreatReport retreat(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                      const RetreatOptions& options, Context& context);

/// Raises the worst cells of a settled mesh, up to options.min_sj: vertices on what they are bound to slide
/// there, the others do not go farther from it, and nothing comes into contact that was not. `effort` and
/// `time_limit_s` bound it. Never more bad cells, never a lower minimum. Errors: cancelled, with the best
/// state so far in `mesh`.
Result<OptimizeStats> raise_settled(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                                    const OptimizeOptions& options, Context& context);

} // namespace hexopt
