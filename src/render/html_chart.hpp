#pragma once

#include <string>
#include <vector>

namespace hexopt {

/// One histogram of a chart: a count for each bin, and a colour (CSS).
struct ChartSeries {
    std::string name, color;
    std::vector<double> count;
};

/// Text with the characters that mean something in HTML replaced.
std::string escape_html(const std::string& text);

/// Histograms with the same bins side by side, as an SVG element. Counts on a logarithmic scale, since the
/// few bad cells matter as much as the many good ones. bin i spans low + i*width to low + (i+1)*width; empty
/// bins at both ends are left out.
std::string histogram_svg(const std::string& title, double low, double width,
                          const std::vector<ChartSeries>& series);

} // namespace hexopt
