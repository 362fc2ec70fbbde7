#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt {

/// A structured grid on a box.
struct GridOptions {
    std::array<Index, 3> cells = {8, 8, 8}; ///< along each axis, >= 1
    Point low = Point(0), high = Point(1);  ///< corners of the box, model units
    Point grading = Point(1);               ///< last cell's size over the first one's along each axis; > 0
};

/// Cells and vertices are numbered x fastest, then y, then z; level 0 throughout. Error (usage): no cells,
/// more vertices or cells than an Index holds, grading not positive.
Result<HexMesh> make_grid(const GridOptions& options, const Parallel& parallel);

/// Moves every vertex by a smooth periodic displacement of `amplitude` of the bounding box (below about 0.1
/// cells stay valid); hanging vertices follow their masters.
void warp(HexMesh& mesh, double amplitude, const Parallel& parallel);

/// Maps the bounding box towards the ball in it: strength 0 leaves the mesh alone, 1 gives the ball, whose
/// corner cells are flat; hanging vertices follow their masters.
void bend_to_ball(HexMesh& mesh, double strength, const Parallel& parallel);

} // namespace hexopt
