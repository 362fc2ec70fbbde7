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
    /// Per patch: patches of one group, such as faces that a CAD file does not name, count as one where their
    /// borders are concerned; empty: each is its own.
    std::vector<Index> patch_group = {};

    Index group_of(Index p) const { return patch_group.empty() ? p : patch_group[p]; }
};

} // namespace hexopt
