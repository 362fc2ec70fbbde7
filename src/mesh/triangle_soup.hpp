#pragma once

#include "core/types.hpp"

#include <array>
#include <string>
#include <vector>

namespace hexopt {

/// Triangles that describe a surface, in any order; nothing about their connectivity is promised.
struct TriangleSoup {
    std::vector<Point> vertices;                 ///< model units
    std::vector<std::array<Index, 3>> triangles; ///< vertices, counter-clockwise seen from outside
    std::vector<Index> patch;                    ///< per triangle: index into patch_names; empty: one patch
    std::vector<std::string> patch_names;
};

} // namespace hexopt
