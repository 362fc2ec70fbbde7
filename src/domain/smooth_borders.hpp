#pragma once

#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/triangle_soup.hpp"

#include <array>
#include <functional>
#include <span>
#include <vector>

namespace hexopt {

struct SmoothBorders {
    std::size_t count = 0;                   ///< curves
    std::vector<std::array<Index, 2>> edges; ///< pairs of vertices of the soup, smaller first
};

/// Borders between patches of one group (TriangleSoup::patch_group) that are no features by their shape but
/// run along bends narrower than cells, such as the nose of a wing: within half a cell of the larger part of
/// such a border the surface turns by 15 degrees or more on each side, by 60 in all. Quads across it would
/// leave the surface by a part of a cell. Only where cells fit beside it: no other line comes within 4 cells
/// of it, but at its ends under 40 degrees or more, and it is longer than that. given: edges that are
/// features anyway. cell_size: edge length of the cells at a point, model units; 0: there are none, so that
/// no border has room there. Errors (bad_input) as clean_surface().
Result<SmoothBorders> find_smooth_borders(const TriangleSoup& surface, const BoundaryOptions& options,
                                          std::span<const std::array<Index, 2>> given,
                                          const std::function<double(const Point&)>& cell_size);

} // namespace hexopt
