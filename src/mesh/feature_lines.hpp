#pragma once

#include "core/types.hpp"

#include <array>
#include <string>
#include <vector>

namespace hexopt {

/// Where features of a surface are, given as segments that meet at equal points.
struct FeatureLines {
    std::string file;                           ///< for messages; may be empty
    std::vector<std::array<Point, 2>> segments; ///< model units; none of length 0
};

} // namespace hexopt
