#pragma once

#include "render/image.hpp"

#include <cstddef>

namespace hexopt {

/// Colour of a scaled Jacobian in 0..1: dark red, orange, yellow, green, blue; values outside take the ends'.
Color quality_color(double scaled_jacobian);

/// Cells that are concave or not certified valid.
inline constexpr Color kBadColor = {0.86f, 0.05f, 0.80f};

/// Colour of a refinement level, from light (0) to dark (deepest).
Color level_color(int level, int deepest);

/// A colour of its own for each patch; neighbours in number differ.
Color patch_color(std::size_t patch);

} // namespace hexopt
