#pragma once

#include "stages/fit/curve_net.hpp"

#include <vector>

namespace hexopt::fit {

/// Per leg: the patch on its left, seen from outside and along the leg; kNoIndex where its curve has not two
/// patches or the triangles do not tell.
std::vector<Index> find_left_patches(const Domain& domain, const CurveNet& net);

} // namespace hexopt::fit
