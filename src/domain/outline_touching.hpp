#pragma once

#include "core/result.hpp"
#include "mesh/outline.hpp"

namespace hexopt {

/// Refuses loops that cross or touch themselves or each other, pass twice through a point or are given
/// twice. Error (bad_input): the first such place in the order of loops and points, with the files and lines
/// of both edges, or their points where there are none. O(n log n) for outlines of ordinary shape.
Status check_touching(const Outline& outline);

/// "FILE:LINE", or "loop N, point M" where the loop comes from no file.
std::string outline_place(const Outline& outline, std::size_t loop, std::size_t point);

} // namespace hexopt
