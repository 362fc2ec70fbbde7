#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "domain/fitted_mesh.hpp"
#include "mesh/hex_reference.hpp"
#include "mesh/topology.hpp"

#include <algorithm>
#include <span>
#include <string>

namespace hexopt {

/// Two vertices in either order.
using EdgeKey = std::uint64_t;
constexpr EdgeKey edge_key(Index a, Index b) { return a < b ? EdgeKey{a} << 32 | b : EdgeKey{b} << 32 | a; }
constexpr Index low_of(EdgeKey edge) { return static_cast<Index>(edge >> 32); }
constexpr Index high_of(EdgeKey edge) { return static_cast<Index>(edge); }

inline Quad sorted_quad(Quad quad) {
    std::sort(quad.begin(), quad.end());
    return quad;
}

/// What hangs on what, as two tables from which the constraints follow: the vertex in the middle of an edge
/// and the one in the centre of a quad.
struct SplitTables {
    struct Middle {
        EdgeKey edge;
        Index vertex;
        auto operator<=>(const Middle&) const = default;
    };
    struct Centre {
        Quad corners; ///< sorted
        Index vertex;
        auto operator<=>(const Centre&) const = default;
    };
    std::vector<Middle> middles; ///< sorted
    std::vector<Centre> centres; ///< sorted

    bool empty() const { return middles.empty() && centres.empty(); }
    Index middle(Index a, Index b) const;      ///< kNoIndex: none
    Index centre(const Quad& any_order) const; ///< kNoIndex: none
    std::vector<Middle> middles_by_vertex() const;
};

/// The tables of a mesh with closed constraints: rows of two halves and of four quarters as they are, others
/// (chains) by the edges and faces of cells whose ends' constraints they are the mean of. Rows of four
/// quarters or chains that no edge or face explains are left out: nothing touches them from the coarse side.
SplitTables find_splits(const HexMesh& mesh);

/// A quad of the boundary.
struct SurfaceQuad {
    CellFace face;
    Index patch;             ///< of the Domain; kNoIndex: none
    Index region = kNoIndex; ///< set of quads that ridges enclose; see surface_regions.hpp
};

/// A FittedMesh in the form in which sheets are inserted.
struct SheetMesh {
    std::vector<Point> positions;
    std::vector<Point> unfitted; ///< as FittedMesh::unfitted
    std::vector<Cell> cells;
    std::vector<std::uint8_t> level; ///< per cell
    std::vector<Association> association;
    std::vector<SurfaceQuad> surface;
    std::vector<FittedMesh::RidgeEdge> ridges; ///< sorted
    SplitTables splits;

    Quad vertices_of(CellFace face) const {
        const auto& local = hex::kFaceVertex[face.face];
        const Cell& cell = cells[face.cell];
        return {cell[local[0]], cell[local[1]], cell[local[2]], cell[local[3]]};
    }
    /// Curve along a mesh edge, kNoIndex if it is no ridge.
    Index curve_of(Index a, Index b) const;
};

/// Error (bad_input): associations, ridges or boundary quads that do not fit the mesh.
Result<SheetMesh> open_sheet_mesh(FittedMesh fitted, const Parallel& parallel);

/// What of a mesh its form for sheets does not hold.
struct SheetMeshOrigin {
    std::vector<std::string> patch_names;
    std::uint64_t revision = 0;
    bool has_level = false;
};
SheetMeshOrigin origin_of(const HexMesh& mesh);

/// The way back; names and revision are those of `origin`, one revision later. Hanging vertices are put where
/// their masters want them; those that no longer hang are bound to the curve or patch they are on. Error
/// (bad_input): constraints that contradict one another.
Result<FittedMesh> close_sheet_mesh(SheetMesh mesh, SheetMeshOrigin origin, const BoundaryModel& model,
                                    const Parallel& parallel);

} // namespace hexopt
