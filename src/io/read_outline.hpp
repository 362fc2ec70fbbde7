#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <filesystem>
#include <glm/vec2.hpp>
#include <vector>

namespace hexopt {

/// Reads a closed plane outline, e.g. an airfoil, from a text file of two coordinates a line: one loop
/// (Selig's order or any other), or Lednicer's upper and lower side, each from the nose, after a line with
/// their counts. The first line may be a title; '#' starts a comment; blank lines count for nothing. Result:
/// counter-clockwise, the first point not repeated, no two equal points in a row, no edges that cross.
/// Errors: bad_input with file and line or point; cancelled.
Result<std::vector<glm::dvec2>> read_outline(const std::filesystem::path& path, Context& context);

} // namespace hexopt
