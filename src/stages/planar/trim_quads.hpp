#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "stages/planar/quad_mesh.hpp"

#include <array>

namespace hexopt {

struct QuadTrimOptions {
    double margin_h = 0.25; ///< least distance of kept cells from the outline, in cell sizes
    /// Whether cells may still be refined; else what does not fit is removed.
    bool may_refine = true;
    bool may_join = true; ///< whether parts of a region may be joined by refining what lies between
};

/// The boundary of the kept cells that belongs to one loop of the outline.
struct KeptLoop {
    Index outline;               ///< loop of the outline
    std::vector<Index> vertices; ///< of the trimmed mesh, kept cells on the left
    std::vector<Index> quads;    ///< quads[i] has the edge from vertices[i] to the next
    std::vector<int> corners;    ///< per vertex: corners of kept cells there, 1..3
};

struct TrimmedQuads {
    QuadMesh mesh; ///< kept cells alone; nothing bound
    std::vector<KeptLoop> loops;
    std::vector<Index> refine_cells; ///< cells of the quadtree to be refined before all fits, rising
    bool asked_to_join = false;      ///< some of these are to join parts
    std::size_t cut_cells = 0, removed_cells = 0;
    std::size_t dropped_cells = 0; ///< of the removed ones: in parts that were not joined
};

/// Keeps the cells of a quadtree (a mesh of hexahedra one cell thick in z) that lie inside the outlines and
/// at a margin from them. Removed, or where that may be refined instead: coarse cells beside an edge that is
/// half boundary, cells that touch others at a vertex only, parts that are separate from a region's largest.
/// Asked for too: cells more than twice as large as a curve that they meet is long. Errors: bad_input where
/// the boundary of what is kept does not have one loop for each loop of the outline, and nothing may be
/// refined; cancelled.
Result<TrimmedQuads> trim_quads(const HexMesh& quadtree, const OutlineCurves& curves,
                                const QuadTrimOptions& options, Context& context);

} // namespace hexopt
