#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace hexopt::io_detail {

/// The arrays of a VTU file's <Cells>, with cells beside hanging vertices as polyhedra.
struct PolyhedralCells {
    std::vector<std::int64_t> connectivity;
    std::vector<std::int64_t> offsets; ///< end of each cell in connectivity
    std::string types;                 ///< VTK_HEXAHEDRON or VTK_POLYHEDRON
    std::vector<std::int64_t> faces;   ///< per polyhedron: number of faces, and of each its size and corners
    std::vector<std::int64_t> face_offsets; ///< end of each cell in faces; -1 for a hexahedron
};

/// Error: as compute_polyhedral_faces().
Result<PolyhedralCells> make_polyhedral_cells(const HexMesh& mesh, const Context& context);

} // namespace hexopt::io_detail
