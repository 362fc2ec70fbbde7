#pragma once

#include "core/types.hpp"
#include "quality/hex_determinants.hpp"

#include <array>

namespace hexopt {

/// What is known of the sign of det J of a cell's trilinear map on the closed cell.
enum class Validity : std::uint8_t {
    valid,     ///< positive everywhere: proved
    invalid,   ///< negative somewhere: proved (or a coordinate is not finite)
    undecided, ///< neither within rounding, e.g. exactly zero at a corner and positive elsewhere
};

const char* name_of(Validity validity);

/// Decides by the 27 Bernstein coefficients of det J (degree 2 in each direction), which bound it from both
/// sides, and adaptive subdivision; every comparison leaves room for the rounding errors so far. A second
/// pass in long double follows where double leaves it open, unless a corner is flat. Coordinates must be
/// finite. Source: Johnen, Weill, Remacle 2017, "Robust and efficient validation of the linear hexahedral
/// element".
Validity certify(const std::array<Point, 8>& points);

/// The same from the coefficients and scale that the caller has at hand already.
Validity certify(const std::array<Point, 8>& points, const hex::Bernstein<double>& coefficients,
                 double scale);

} // namespace hexopt
