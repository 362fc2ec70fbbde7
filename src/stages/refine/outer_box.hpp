#pragma once

#include "domain/domain.hpp"

#include <cstdint>
#include <vector>

namespace hexopt {

/// Which triangles are the sides of a box round a body (external flow): those in the planes of the surface's
/// bounding box, where they cover at least 80 % of it and the others reach at most two of its planes, as
/// the ground or a plane of symmetry that cuts the body. planar: the sides across z are left aside. Per
/// triangle of the model; empty: there is no such box.
std::vector<std::uint8_t> find_outer_box(const Domain& domain, bool planar);

} // namespace hexopt
