#pragma once

#include "core/types.hpp"

namespace hexopt {

/// A directed edge between two points.
struct Segment {
    Point from, to;
};

/// Sign (-1, 0, 1) of det(a, b, c), the edges' vectors as columns, decided in exact arithmetic from the
/// coordinates as given. Coordinates must be finite. Exact unless the magnitudes of the non-zero coordinate
/// differences span more than 2^300. Slow (a few microseconds): meant for what a double cannot decide.
/// Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric
/// predicates".
int exact_sign_of_determinant(const Segment& a, const Segment& b, const Segment& c);

} // namespace hexopt
