#pragma once

#include "pipeline/mesh_surface.hpp"

#include <limits>

namespace hexopt {

/// What trimming the same octree time and again shares.
struct TrimRounds {
    int count = 0; ///< times that cells were trimmed
    TrimMemory memory;
};

/// Trims, and refines what trimming asks for and where the surface has no cells near it, until there is
/// nothing left. Cells at bare places are halved up to refined.finest_size, and not at all where what is
/// behind the surface is thinner than those could resolve. narrow_levels: up to so many levels beyond that,
/// 0..20, until three cells fit between a bare place and what is opposite, widest places first, as far as
/// that takes about a tenth of the cells. max_cells: what the octree may come to at the most; for partial
/// faces it may grow by a hundredth beyond refined.max_cells. Where these may not be refined any more, or
/// have asked alone for three rounds, cells there are removed instead. rounds: for one `refined` and one
/// domain. most_kept: where kept_once_halved() is more after the first, that is the outcome.
/// Errors: as trim() (*leak gets the path where the surface leaks); cancelled.
Result<TrimOutput> trim_in_rounds(RefineOutput& refined, const Domain& domain, TrimOptions options,
                                  std::size_t max_cells, TrimRounds& rounds, Context& context, LeakPath* leak,
                                  int narrow_levels = 0,
                                  double most_kept = std::numeric_limits<double>::infinity());

/// Where nearly all of the surface is bare, how many cells will be kept, one across the walls, once they are
/// halved as far as gaps may; 0 elsewhere.
double kept_once_halved(const RefineOutput& refined, const TrimOutput& trimmed);

/// Error (no_valid_mesh) where cells are kept at less than 70 % of the surface, or of a closed surface's
/// volume where more than a tenth of it is bare: says where, how thick the model is there and what cells it
/// needs.
Status check_coverage(const TrimOutput& trimmed);

/// One sentence on what is bare; empty where nothing worth telling is.
std::string describe_bare_surface(const TrimReport& report);

} // namespace hexopt
