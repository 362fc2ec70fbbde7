#pragma once

#include "mesh/polyhedral_faces.hpp"

namespace hexopt {

/// Centre of a cell as a finite-volume solver takes it, and its volume (model units cubed).
struct CellCentre {
    Point point;
    double volume;
};

/// Whether faces can be cut into triangles from one of their corners, and from their centre, such that the
/// tetrahedra that these span with the centres of the cells on both sides are positive: what OpenFOAM tracks
/// particles through, and what its checkMesh asks of each face ("face tets", polyMeshTetDecomposition). Cells
/// may be valid and their common face be so warped that one needs the one diagonal of it and the other one
/// the other.
class FaceTets {
  public:
    /// faces: of the mesh whose positions are given below; outlives this.
    FaceTets(const PolyhedralFaces& faces, std::size_t cell_count)
        : faces_(faces), of_cell_(faces_of_cells(faces, cell_count)) {}

    /// The centroid of the pyramids over the cell's faces, as OpenFOAM computes it.
    CellCentre centre(std::size_t cell, std::span<const Point> positions) const;

    /// Of the corners that a face may be cut from, the best: its smallest tetrahedron over the volume of the
    /// cell that this is in, at most 1; or the smallest from the centre of the face, these counted as large
    /// as those from corners are in a cube, where that is less. Not positive: the face is warped. The centres
    /// are those of its cells, the second one unused at the boundary.
    double margin(std::size_t face, std::span<const Point> positions, const CellCentre& owner,
                  const CellCentre& neighbour) const;
    double margin(std::size_t face, std::span<const Point> positions) const;

    /// Faces whose margin is not above `least`, rising.
    std::vector<std::size_t> find_warped(std::span<const Point> positions, double least,
                                         const Parallel& parallel) const;

    std::span<const Index> corners(std::size_t face) const { return faces_.vertices[face]; }
    bool is_internal(std::size_t face) const { return face < faces_.internal_count(); }
    Index owner(std::size_t face) const { return faces_.owner[face]; }
    Index neighbour(std::size_t face) const { return faces_.neighbour[face]; }
    /// As faces_of_cells().
    std::span<const std::size_t> faces_of(std::size_t cell) const { return of_cell_[cell]; }

  private:
    const PolyhedralFaces& faces_;
    Csr<std::size_t> of_cell_;
};

} // namespace hexopt
