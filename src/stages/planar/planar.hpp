#pragma once

#include "stages/planar/extrude.hpp"
#include "stages/planar/relax_quads.hpp"
#include "stages/planar/wall_row.hpp"

namespace hexopt {

struct PlanarFit {
    QuadMesh mesh;                   ///< empty while refine_cells is not
    std::vector<Index> refine_cells; ///< cells of the quadtree to be refined before all fits, rising
    bool asked_to_join = false;      ///< as in TrimmedQuads
    WallRowReport row;
    std::size_t kept_cells = 0, cut_cells = 0, removed_cells = 0, dropped_cells = 0;
};

/// From a quadtree to a mesh of the region inside the outlines: trims, joins the kept cells' boundary to the
/// outlines loop by loop, and closes the gap with a row of quads; nothing is smoothed yet. Errors: those of
/// trim_quads(); bad_input where a kept loop has too few edges for its outline's corners and nothing may be
/// refined.
Result<PlanarFit> fit_outline(const HexMesh& quadtree, const OutlineCurves& curves,
                              const QuadTrimOptions& options, Context& context);

/// Cells of the quadtree that are too large for a fitted mesh: at edges on an outline whose chord leaves it
/// by more than `largest_deviation` (model units; 0: any will do) or that cross others, and round quads that
/// are inverted.
std::vector<Index> find_coarse_cells(const QuadMesh& mesh, const HexMesh& quadtree,
                                     const OutlineCurves& curves, double largest_deviation);

} // namespace hexopt
