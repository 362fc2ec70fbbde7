#pragma once

#include "core/context.hpp"
#include "samples/geometry/solid.hpp"

#include <string>

namespace hexopt::geometry {

/// A NACA section of chord 1 from (0, 0) to (1, 0), counter-clockwise from its sharp trailing edge over the
/// upper side, 2 * points_per_side points close together at both ends.
struct NacaSection {
    double camber = 0, camber_place = 0.4; ///< largest camber and its place, fractions of the chord
    double thickness = 0.12;               ///< fraction of the chord
};
std::vector<Point2> make_naca_four(const NacaSection& section, int points_per_side);

/// By its code of four or five digits, e.g. "2412", "23012", "23112" (reflexed). Error (usage): no such code.
Result<std::vector<Point2>> make_naca(const std::string& code, int points_per_side);

/// A code as make_naca() takes it, or a file as read_outline() does.
Result<std::vector<Point2>> make_airfoil(const std::string& code_or_file, int points_per_side,
                                         Context& context);

} // namespace hexopt::geometry
