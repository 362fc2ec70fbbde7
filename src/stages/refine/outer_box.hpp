#pragma once

#include "domain/domain.hpp"

#include <cstdint>
#include <vector>

namespace hexopt {

/// Which patches are the sides of a box round a body (external flow): those in the planes of the surface's
/// bounding box, where they cover at least 80 % of it and the other patches reach at most two of its planes.
/// planar: the sides across z are left aside. Empty: there is no such box.
std::vector<std::uint8_t> find_outer_box(const Domain& domain, bool planar);

} // namespace hexopt
