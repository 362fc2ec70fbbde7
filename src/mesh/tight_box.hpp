#pragma once

#include "core/types.hpp"

#include <glm/mat3x3.hpp>

#include <vector>

namespace hexopt {

/// Rotation to the axes in which the points' bounding box has a diagonal about as short as can be. Found by
/// search from fixed directions: depends on the points alone, to the last bit, not on their order.
glm::dmat3 find_tight_box(const std::vector<Point>& points);

} // namespace hexopt
