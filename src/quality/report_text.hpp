#pragma once

#include "quality/mesh_quality.hpp"

#include <string>

namespace hexopt {

/// The report for people: figures, histograms as bars, the worst cells. Lines end with a newline.
std::string to_text(const QualityReport& report);

/// One line: counts and scaled Jacobian.
std::string to_line(const ValidityCounts& counts);

} // namespace hexopt
