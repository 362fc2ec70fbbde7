#pragma once

#include "core/context.hpp"
#include "domain/domain.hpp"
#include "stages/fit/capture.hpp"

#include <vector>

namespace hexopt::fit {

/// Why no mesh edges follow a curve.
enum class Release : std::uint8_t {
    none,    ///< they do
    open,    ///< the surface ends or branches there: a hole or a flaw, not a feature to follow
    corner,  ///< no vertex is free near one of its ends
    blocked, ///< no path of free edges runs along it
    sides,   ///< its path has not its own two patches beside it: the mesh is too coarse there
    small,   ///< it is too small for the cells: a point stands for it, or nothing
};

/// "open", "corner", ...
const char* name_of(Release reason);

/// What part of the domain each quad and vertex of the surface belongs to.
struct Regions {
    std::vector<Index> quad_patch; ///< per quad
    std::vector<Release> released; ///< per curve
    bool kept(Index curve) const { return released[curve] == Release::none; }
    std::vector<Index>
        edge_curve; ///< per surface edge: kNoIndex where no curve runs; also parts of released ones
};

/// Cuts the surface along the paths and gives each piece the patch that most of its quads lie on. A curve
/// whose path has not its own two patches beside it everywhere, or that lacks a leg, is released: its patches
/// are told apart quad by quad, and edges follow it only where that gives them its patches. Repeated until
/// all that is left is consistent.
Regions find_regions(const SurfaceMesh& surface, const std::vector<Point>& placed, const Domain& domain,
                     const CurveNet& net, const Capture& capture, const Context& context);

} // namespace hexopt::fit
