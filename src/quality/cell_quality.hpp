#pragma once

#include "mesh/hex_mesh.hpp"
#include "quality/certificate.hpp"

#include <array>
#include <cstdint>

namespace hexopt {

using HexPoints = std::array<Point, 8>; ///< a cell's corners in VTK order, model units

inline HexPoints cell_points(const HexMesh& mesh, std::size_t cell) {
    HexPoints points;
    for (int k = 0; k < 8; ++k) points[k] = mesh.positions[mesh.cells[cell][k]];
    return points;
}

/// Whether a cell is fit for use. The counts are of tetrahedra whose determinant is not positive, decided
/// exactly from the coordinates (thesis 4.2.2).
struct CellValidity {
    double scaled_jacobian = -1; ///< least over the 8 corners of det(e1,e2,e3) / (|e1||e2||e3|), -1..1;
                                 ///< a corner with an edge of length 0 counts as 0
    std::uint8_t concave8 = 8;   ///< corner tetrahedra, 0..8
    std::uint8_t concave24 = 24; ///< edge-path tetrahedra, 0..24
    Validity validity = Validity::invalid; ///< of the trilinear map

    bool is_finite = false; ///< all coordinates are

    bool is_concave() const { return concave8 + concave24 > 0; }
    bool is_usable() const { return !is_concave() && validity == Validity::valid; }
};

/// Cells that are not usable are worse than those that are, each group by scaled Jacobian.
inline bool is_worse(const CellValidity& a, const CellValidity& b) {
    if (a.is_usable() != b.is_usable()) return b.is_usable();
    return a.scaled_jacobian < b.scaled_jacobian;
}

/// All figures of one cell.
struct CellQuality {
    CellValidity validity;
    double volume = 0; ///< of the trilinear map, exact but for rounding; negative when turned over
    double min_edge = 0, max_edge = 0;         ///< lengths of the 12 edges
    double min_dihedral = 0, max_dihedral = 0; ///< degrees, 0..180; see dihedral_angles
    /// Longest over shortest edge, >= 1; infinite when an edge has length 0.
    double aspect_ratio() const;
};

/// What a cell's figures are the extremes of.
struct CellDetails {
    std::array<double, 24> dihedral;    ///< degrees, as dihedral_angles gives them
    std::array<double, 12> edge_length; ///< numbered as hex::kEdgeVertex
};

/// Angles in degrees (0..180) between the two faces at each end of each edge, from the corners' normals: at
/// [3k + d] the one at corner k along its edge in direction d. A vanishing normal gives 0. Reflex angles are
/// not told apart: see CellValidity for those.
std::array<double, 24> dihedral_angles(const HexPoints& points);

/// Scaled Jacobian as in CellValidity; -1 when a coordinate is not finite.
double scaled_jacobian(const HexPoints& points);

/// Lengths of the 12 edges, numbered as hex::kEdgeVertex.
std::array<double, 12> edge_lengths(const HexPoints& points);

/// A cell with a coordinate that is not finite is the worst of all: the defaults of CellValidity.
CellValidity compute_cell_validity(const HexPoints& points);

/// Figures of one cell; `details` is filled where given (with zeros for a cell that is not finite).
CellQuality compute_cell_quality(const HexPoints& points, CellDetails* details = nullptr);

} // namespace hexopt
