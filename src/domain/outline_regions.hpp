#pragma once

#include "core/result.hpp"
#include "domain/segment_tree.hpp"
#include "mesh/outline.hpp"

#include <span>

namespace hexopt {

/// What of the plane is to be meshed.
struct RegionChoice {
    /// Places in what is to be meshed; none: with `outer_first` the region inside the first loop that no
    /// other loop encloses within it, else all regions of at least `part_fraction` of the largest one's area.
    std::vector<Point2> seeds;
    double part_fraction = 0;
    bool outer_first = false; ///< the first loop is a farfield round all others
};

struct RegionReport {
    std::size_t regions = 0;         ///< connected regions that are kept
    std::size_t dropped_regions = 0; ///< and that are not
    std::size_t dropped_loops = 0;
};

/// Keeps the loops of the chosen regions and turns them such that the region lies on their left: outer loops
/// counter-clockwise, holes clockwise. Loops may not cross or touch (check_touching()). Errors: usage (a seed
/// that is in no region), bad_input (nothing is left).
Result<Outline> choose_regions(Outline outline, const RegionChoice& choice, RegionReport& report);

/// A rectangle as the first loop, its sides the patches farfield_x_min, ..., named after the model's axes.
/// Errors: usage (an empty rectangle, a point of the outline that is not inside).
Result<Outline> add_farfield(Outline outline, const Box2& box);

/// Bounding box of all loops, or where the first loop encloses the others and is a rectangle along the axes
/// (a farfield) of the others: what "relative" distances of a planar mesh refer to.
Box2 body_box(const Outline& outline);

} // namespace hexopt
