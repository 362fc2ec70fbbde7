#pragma once

#include "domain/narrow_curves.hpp"
#include "pipeline/mesh_surface.hpp"
#include "pipeline/trim_rounds.hpp"

#include <optional>

namespace hexopt {

/// An octree and, where it had to be looked at to be counted, what that gave.
struct CountedOctree {
    RefineOutput refined;
    TrimRounds rounds;
    NarrowCurves narrow;               ///< what attempts go without, too narrow for the octree's cells
    std::optional<TrimOutput> trimmed; ///< without `kept` where `fitted` is there
    std::optional<FitOutput> fitted;   ///< to leave_out(domain, narrow)
};

/// How octrees are trimmed: as options.trim says, but where fewer than 20,000 cells are wanted thin walls get
/// no layers of cells, as what these take cannot be told beforehand.
TrimOptions trim_options(const MeshOptions& options);

/// Refines such that the finished mesh has about as many cells as wanted: as refine(), but what counts is
/// what trimming keeps, the buffer layers that it gets once it is fitted (a small mesh tells beforehand how
/// many about), and what repairs will add. Room for these is left: RefineOutput::max_cells is where they
/// would lead too far beyond what is wanted. A given surface size is taken as it is. Errors: as refine(),
/// trim(), fit_boundary() and insert_buffers().
Result<CountedOctree> refine_to_count(const Domain& domain, const MeshOptions& options, StageClock& clock,
                                      Context& context, LeakPath* leak);

} // namespace hexopt
