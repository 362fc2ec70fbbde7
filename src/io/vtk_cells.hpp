#pragma once

#include "io/mesh_builder.hpp"

#include <span>

namespace hexopt::io_detail {

/// Cells as both VTK formats store them.
struct VtkCells {
    std::vector<std::uint64_t> offsets; ///< cell c uses connectivity[offsets[c] .. offsets[c+1])
    std::vector<Index> connectivity;
    std::vector<std::uint8_t> types; ///< VTK's numbers, e.g. 12 for a hexahedron

    std::size_t count() const { return types.size(); }
};

/// Where the cells of the file went.
struct VtkCellMap {
    std::vector<Index> hexahedra; ///< the file's number of each hexahedron of the mesh
    std::vector<Index> quads;     ///< and of each of MeshBuilder::quads
};

/// Sorts cells into hexahedra (voxels among them), quadrilaterals (pixels among them) and counts of others.
/// The quads' patch is left 0. Sizes must fit together already (offsets rising, within connectivity); a type
/// with the wrong number of vertices is an error at locate(cell).
Status add_vtk_cells(MeshBuilder& builder, const VtkCells& cells, VtkCellMap& map, const Locate& locate);

/// Arrays of a file before they are reduced to its hexahedra.
struct VtkArrays {
    std::vector<FieldData> point, cell; ///< one tuple each vertex, each cell of the file
    std::vector<FieldData> field;       ///< no particular length
    std::vector<std::string> patch_names;
};

/// Takes over the file's arrays: constraints, level and patches into the mesh, others into builder.fields,
/// and gives the quads their patches from the first cell array that is named "patch", "gmsh:physical",
/// "medit:ref" or "CellEntityIds".
Status add_vtk_arrays(MeshBuilder& builder, VtkArrays&& arrays, const VtkCellMap& map, std::size_t cell_count,
                      const Context& context);

} // namespace hexopt::io_detail
