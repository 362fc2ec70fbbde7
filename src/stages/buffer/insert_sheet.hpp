#pragma once

#include "stages/buffer/edge_uses.hpp"

#include <string_view>

namespace hexopt {

/// What a sheet shrinks: cells A, and boundary quads B of A that stay where they are.
struct SheetChoice {
    bool all_cells = false;
    std::vector<Index> cells; ///< A; ignored with all_cells
    std::vector<Index> quads; ///< B: places in SheetMesh::surface
};

/// Why a sheet cannot be inserted at a vertex.
enum class SheetFault {
    open_face,  ///< a face of A has no partner: it is covered in part only
    crossed,    ///< more than two of its quads meet at an edge
    pinched,    ///< its quads at the vertex are not one fan
    half_strip, ///< it would leave through the surface on one half of an edge only
    open_sheet, ///< it ends at an edge inside the mesh
    crowded,    ///< what A keeps of the surface there has more ridges than can go on
};
const char* name_of(SheetFault fault);

struct SheetProblem {
    Index vertex;
    SheetFault fault;
    auto operator<=>(const SheetProblem&) const = default;
};

/// A quad between A and the rest, or one of B.
struct SheetQuad {
    Quad vertices; ///< counter-clockwise seen from outside A
    Index inside;  ///< cell of A
    Index surface; ///< place in SheetMesh::surface; kNoIndex: the quad lies inside the mesh
};

/// A side of a sheet quad that comes to lie on the surface.
struct StripQuad {
    Index quad;
    std::uint32_t side;
    Index patch, region; ///< of the surface that A keeps beside it
};

struct SheetVertex {
    Index vertex;
    Association inner;            ///< of the copy, which A takes
    Association outer;            ///< of the vertex itself
    Index strip_curve = kNoIndex; ///< curve that the edge from the vertex to its copy continues
    bool inner_stays = false;     ///< the copy keeps the place, the vertex itself moves off
};

/// All that inserting needs to know; nothing of the mesh is changed while it is made.
struct SheetPlan {
    std::vector<std::uint8_t> in_a; ///< per cell
    std::vector<std::uint8_t> in_b; ///< per surface quad
    std::vector<SheetQuad> quads;
    std::vector<StripQuad> strips;
    std::vector<SheetVertex> vertices;  ///< by rising vertex
    std::vector<Index> inner_ridges;    ///< places in SheetMesh::ridges that go with A
    std::vector<SheetProblem> problems; ///< sorted; a plan with any cannot be carried out
};

SheetPlan plan_sheet(const SheetMesh& mesh, const SheetChoice& choice);

/// Inserts one layer of cells between the cells A and the rest, and under B. The vertices of the quads
/// between are doubled: cells of A and their boundary quads outside B take the copy; one cell per quad; sides
/// of these that come to lie on the surface get the patch that A has there. Quads on the fine side count
/// where levels meet; an edge's midpoint and a quad's centre pass to a copy if the copies of all its parts
/// exist. A copy starts at 0.4 of the way to the middle of what it goes with on its curve or patch, or of its
/// cells, projected on what it is bound to. The mesh is unchanged if problems are returned. Source:
/// fitting-notes 4 after Mitchell and Tautges 1995 (pillowing). Cost: two passes over the cells' vertices,
/// the rest proportional to the sheet and the surface.
std::vector<SheetProblem> insert_sheet(SheetMesh& mesh, const SheetChoice& choice, const BoundaryModel& model,
                                       const Parallel& parallel);

} // namespace hexopt
