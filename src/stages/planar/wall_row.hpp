#pragma once

#include "stages/planar/match_loop.hpp"

#include <array>

namespace hexopt {

struct WallRowReport {
    std::size_t cells = 0;                   ///< of the row
    std::array<std::size_t, 5> corners = {}; ///< sharp corners by how many cells meet there, 1..4
};

/// Closes the gap between a kept loop and its outline by a row of quads: one for each edge of the kept loop
/// between two links, one more at a corner with one cell, and at corners with three and four cells one and
/// two that have two edges of the kept loop each. New vertices are bound to the outline.
void add_wall_row(const KeptLoop& loop, const std::vector<WallLink>& links, const OutlineCurves& curves,
                  QuadMesh& mesh, WallRowReport& report);

} // namespace hexopt
