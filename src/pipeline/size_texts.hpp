#pragma once

#include "stages/refine/refine.hpp"

#include <string>

namespace hexopt {

/// Regions and features with their sizes as words, e.g. "sphere 0,0,0,1 size=0.1 within=0.5" and
/// "wing body level=6", as configuration files and flags have them. The parsers return what is wrong, or
/// nothing.
std::string parse_region(const std::string& text, RegionTarget& region);
std::string parse_curve(const std::string& text, CurveTarget& curve);
std::string to_text(const RegionTarget& region);
std::string to_text(const CurveTarget& curve);

} // namespace hexopt
