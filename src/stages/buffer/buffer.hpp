#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "domain/fitted_mesh.hpp"
#include "stages/buffer/insert_sheet.hpp"

#include <string>

namespace hexopt {

enum class BufferMethod {
    groups, ///< sheets per group of patches, pillows at concave ridges, collars where needed (default)
    thesis, ///< one pillow of the whole surface, then an isolated layer under every patch (thesis 3.5)
};

/// Angles are interior dihedral angles, degrees.
struct BufferOptions {
    BufferMethod method = BufferMethod::groups;
    double join_deg = 135;   ///< 0..360: buffer 1 splits at ridges below this only
    double pillow_deg = 225; ///< 0..361: buffer 1b at ridges from this on; 361: none
    bool collars = true;     ///< buffer 2, on patches that still have flat quads or cells with two faces
    /// 0..2: groups of patches along which the cells are a lattice that fits, all of at least this scaled
    /// Jacobian as fitted, get no layers (it is better than what layers make of it); above 1: all get them.
    double enough_sj = 0.3;
    double corner_deg =
        40;              ///< 0..180: a patch whose boundary turns by less at a joined ridge gets a collar too
    int band_quads = 4;  ///< >= 1: width of what counts as the side of a ridge that ends inside a patch
    int reach_quads = 6; ///< >= 1: how far buffers 1b and 2 reach from the ridges and quads that they are for
    int relax_sweeps = 10; ///< >= 0: Laplacian steps that spread the layers at the end
};

enum class SheetKind { group, pillow, collar };
const char* name_of(SheetKind kind);

/// What buffers are to cure, and what they make of ridges.
struct BufferCounts {
    std::size_t cells = 0, vertices = 0, surface_quads = 0;
    std::size_t flat_quads = 0;     ///< two consecutive sides on one curve, no corner between
    std::size_t two_face_cells = 0; ///< two faces on one patch, joined at an edge that is no ridge
    /// Ridge edges by their curve's largest angle and how many cells have the edge.
    struct RidgeCells {
        double below_deg;                      ///< angles from the last row's limit to this
        std::array<std::size_t, 9> edges = {}; ///< [n]: with n cells; the last: with 8 or more
    };
    std::vector<RidgeCells> ridge_cells; ///< below 135, 225 and 360 degrees
};

/// A sheet that could not be inserted, or a place that it had to go round.
struct SkippedSheet {
    SheetKind kind;
    std::vector<Index> patches; ///< of the Domain, rising
    SheetFault fault;
    Index vertex; ///< of the input mesh, or of the mesh when the sheet was tried
    Point position;
    bool whole; ///< false: the sheet is there but for the cells at the vertex and what they blocked
};

struct BufferReport {
    BufferCounts before, after;
    std::size_t groups = 0;        ///< sets of patches that buffer 1 covered in one
    std::size_t spared = 0;        ///< sets of patches whose cells were good enough without
    std::size_t spared_quads = 0;  ///< of the surface, on these
    std::size_t pillows = 0;       ///< sheets of buffer 1b
    std::size_t collars = 0;       ///< sheets of buffer 2
    std::size_t passes = 0;        ///< over the mesh: sheets that do not touch go in one
    std::size_t joined_groups = 0; ///< joined because they could not be covered one by one
    std::vector<SkippedSheet> skipped;
};

struct BufferOutput {
    FittedMesh fitted;
    BufferReport report;
};

/// Inserts the buffer layers of thesis 3.5 as fitting-notes section 4 has them: buffer 1, one sheet under
/// each group of patches, which leaves through the surface at convex ridges; buffer 1b, closed pillows on
/// both sides of sharp concave ridges; buffer 2, collars. Cells, vertices and boundary quads are added, old
/// vertices keep their numbers; the boundary stays on the domain, with new vertices bound to it. Cells may
/// end inverted where the input's are or nearly so: optimize() with the new associations mends them. A sheet
/// that cannot be inserted is left out and reported. Errors: bad_input (bindings that do not fit mesh or
/// domain); usage (an option out of range); cancelled.
Result<BufferOutput> insert_buffers(FittedMesh fitted, const Domain& domain, const BufferOptions& options,
                                    Context& context);

} // namespace hexopt
