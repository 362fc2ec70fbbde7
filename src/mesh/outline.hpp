#pragma once

#include "mesh/plane_frame.hpp"

#include <span>
#include <string>
#include <vector>

namespace hexopt {

/// A closed curve in the plane: straight segments from each point to the next and from the last to the first.
struct OutlineLoop {
    std::vector<Point2> points; ///< the first one not repeated
    std::vector<Index> patch;   ///< per segment, the i-th begins at point i: index into patch_names
    std::string source;         ///< file, for messages; may be empty
    std::vector<Index> line;    ///< per point: its line in the file, 1-based; empty where it has none
};

/// Closed curves that bound a region of the plane: what lies inside an odd number of them.
struct Outline {
    std::vector<OutlineLoop> loops;
    std::vector<std::string> patch_names;
    PlaneFrame frame;  ///< of the plane that it lies in
    double height = 0; ///< the plane's third coordinate in that frame

    /// A place in the plane, for messages.
    std::string describe(const Point2& p) const { return frame.describe(p, height); }
};

/// Twice the signed area of a closed polygon, positive where it runs counter-clockwise.
double twice_area(std::span<const Point2> points);

} // namespace hexopt
