#pragma once

#include "stages/trim/kept_cells.hpp"

namespace hexopt::trimming {

/// Faces and edges of kept cells that are half on the surface and half inside.
struct PartialSides {
    std::vector<Index> face_rows;                 ///< rows of CellGraph::coarse_faces
    std::vector<std::array<Index, 2>> edges;      ///< vertices
    std::vector<std::vector<Index>> edge_middle;  ///< vertices inside those edges
    std::vector<std::array<Index, 2>> edge_parts; ///< those parts of them that are on the surface
    bool empty() const { return face_rows.empty() && edges.empty(); }
};

PartialSides find_partial_sides(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept);

/// The large kept cells there, rising.
std::vector<Index> cells_to_refine(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                                   const PartialSides& partial);

/// Keeps the cells that are missing behind half faces and round half edges where their centres are hardly
/// outside: a flat wall would otherwise be refined from one end to the other. Returns how many.
std::size_t fill_partial(const CellGraph& graph, const CellSides& sides, KeptCells& kept,
                         const PartialSides& partial);

/// Removes the large kept cells there, or the small ones where a face of a large one is part of a still
/// larger cell's. (The small ones leave partial faces beside them, and so on all along a front between
/// levels.) Returns how many.
std::size_t remove_partial(const HexMesh& mesh, const CellGraph& graph, KeptCells& kept,
                           const PartialSides& partial);

} // namespace hexopt::trimming
