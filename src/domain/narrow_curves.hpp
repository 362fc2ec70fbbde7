#pragma once

#include "domain/domain.hpp"
#include "domain/split_curves.hpp"

#include <functional>
#include <vector>

namespace hexopt {

/// What counts as narrow.
struct NarrowOptions {
    double width =
        0.3; ///< between two curves that meet, in cells, below which one is given up; half: of ledges
    double shortest = 1.5;    ///< of a narrow part that a curve is cut for, in cells
    double shortest_rest = 1; ///< of what is left of a curve, in cells
    double ledge_deg = 30;    ///< by which two edges of a ledge may turn the surface in all
    double below_deg = 60;    ///< only curves that turn by less all along are given up for sharper ones
};

/// Parts of curves along which another one runs so near that no cells fit between them.
struct NarrowCurves {
    std::vector<CurveCut> cuts; ///< which make curves of their own of the parts, rising
    std::vector<Index> narrow;  ///< those curves, as split_curves() numbers them, rising
};

/// Whether a curve may be given up: it turns by less than `below_deg` all along, is no edge of an open
/// surface and parts no patches of different groups of names.
bool may_give_up(const Domain& domain, Index curve, double below_deg);

/// Finds where two curves converge until they meet, so that the patch between them ends in a cusp: the
/// blunter one is given up if it may be. Where two are half as near and turn the surface there and back (a
/// ledge), both are, however sharp, whether they meet or not. cell_size: edge length of the cells at a point,
/// model units; 0: there are none.
NarrowCurves find_narrow_curves(const Domain& domain, const std::function<double(const Point&)>& cell_size,
                                const NarrowOptions& options);

} // namespace hexopt
