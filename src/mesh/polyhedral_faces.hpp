#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/topology.hpp"

#include <string>
#include <vector>

namespace hexopt {

/// The faces of a mesh with hanging vertices as one of conforming polyhedra: a face takes the hanging
/// vertices on its edges as corners, and where levels meet the small faces stand for the large one. First the
/// faces between cells, by rising lower and then higher cell; then those of each patch, by rising cell.
struct PolyhedralFaces {
    Csr<Index> vertices;          ///< per face: its corners, seen from outside `owner` counter-clockwise
    std::vector<Index> owner;     ///< the only cell, or the lower one of two
    std::vector<Index> neighbour; ///< the higher one; of the faces between cells only
    std::vector<std::string> patch_names; ///< the mesh's; then "boundary" if some faces have no patch
    std::vector<std::size_t> patch_start; ///< per patch: its first face; and the number of faces

    std::size_t count() const { return owner.size(); }
    std::size_t internal_count() const { return neighbour.size(); }
};

/// Error (bad_input): a cell whose faces do not close, as where two hanging vertices have the same
/// constraint.
Result<PolyhedralFaces> compute_polyhedral_faces(const HexMesh& mesh, const Topology& topology,
                                                 const Parallel& parallel);

/// Faces of every cell, rising; bit 0: the cell is the face's neighbour, the rest: the face.
Csr<std::size_t> faces_of_cells(const PolyhedralFaces& faces, std::size_t cell_count);

} // namespace hexopt
