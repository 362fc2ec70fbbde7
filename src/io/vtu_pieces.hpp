#pragma once

#include "io/vtk_cells.hpp"

namespace hexopt::io_detail {

/// One piece of a VTU file, checked: ids lie within its points.
struct VtuPiece {
    std::vector<Point> positions;
    VtkCells cells;
    std::vector<FieldData> point, cell;
};

/// Makes one mesh of the pieces. Pieces of a partitioned mesh repeat the vertices between them: vertices of
/// different pieces at exactly the same position become one. Arrays that not every piece has are left out.
/// Both is logged.
VtuPiece join_pieces(std::vector<VtuPiece>&& pieces, const std::string& file, const Context& context);

} // namespace hexopt::io_detail
