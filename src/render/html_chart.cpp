#include "render/html_chart.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr double kWidth = 640, kHeight = 250, kLeft = 44, kRight = 16, kTop = 30, kBottom = 34;

struct Bins {
    std::size_t first = 0, last = 0; ///< the last one included
    double most = 1;
};

Bins used_bins(const std::vector<ChartSeries>& series) {
    Bins bins{std::string::npos, 0, 1};
    for (const ChartSeries& s : series)
        for (std::size_t i = 0; i < s.count.size(); ++i) {
            if (!(s.count[i] > 0)) continue;
            bins.first = std::min(bins.first, i);
            bins.last = std::max(bins.last, i);
            bins.most = std::max(bins.most, s.count[i]);
        }
    if (bins.first == std::string::npos) bins.first = 0;
    return bins;
}

/// Height above the axis in pixels: one decade of room below a count of 1, so that it can be seen.
double bar_height(double count, double most) {
    if (!(count > 0)) return 0;
    const double decades = std::ceil(std::log10(std::max(most, 10.0)));
    return (kHeight - kTop - kBottom) * (std::log10(std::max(count, 1.0)) + 0.3) / (decades + 0.3);
}

/// A power of ten: 100, 1k, 10M.
std::string round_count(double count) {
    if (count >= 1e6) return fmt::format("{:.0f}M", count / 1e6);
    if (count >= 1e3) return fmt::format("{:.0f}k", count / 1e3);
    return fmt::format("{:.0f}", count);
}

std::string grid_svg(double most) {
    std::string svg;
    for (double count = 1; count <= std::pow(10, std::ceil(std::log10(std::max(most, 10.0)))); count *= 10) {
        const double y = kHeight - kBottom - bar_height(count, most);
        svg += fmt::format("<line class=\"grid\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
                           "<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
                           kLeft, kWidth - kRight, y, y, kLeft - 6, y + 4, round_count(count));
    }
    return svg;
}

std::string legend_svg(const std::vector<ChartSeries>& series) {
    std::string svg;
    double x = kWidth - kRight - 90.0 * static_cast<double>(series.size());
    for (const ChartSeries& s : series) {
        svg += fmt::format("<rect x=\"{:.0f}\" y=\"8\" width=\"11\" height=\"11\" fill=\"{}\"/>"
                           "<text x=\"{:.0f}\" y=\"18\">{}</text>\n",
                           x, escape_html(s.color), x + 16, escape_html(s.name));
        x += 90;
    }
    return svg;
}

} // namespace

std::string escape_html(const std::string& text) {
    std::string escaped;
    for (char c : text) {
        switch (c) {
        case '&':
            escaped += "&amp;";
            break;
        case '<':
            escaped += "&lt;";
            break;
        case '>':
            escaped += "&gt;";
            break;
        case '"':
            escaped += "&quot;";
            break;
        case '\'':
            escaped += "&#39;";
            break;
        default:
            escaped += c;
        }
    }
    return escaped;
}

std::string histogram_svg(const std::string& title, double low, double width,
                          const std::vector<ChartSeries>& series) {
    const Bins bins = used_bins(series);
    const double step = (kWidth - kLeft - kRight) / static_cast<double>(bins.last - bins.first + 1);
    const double bar = 0.84 * step / static_cast<double>(std::max<std::size_t>(1, series.size()));
    std::string svg = fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\">\n"
                                  "<text class=\"title\" x=\"{:.0f}\" y=\"18\">{}</text>\n",
                                  kWidth, kHeight, escape_html(title), kLeft, escape_html(title));
    svg += grid_svg(bins.most) + legend_svg(series);
    for (std::size_t i = bins.first; i <= bins.last; ++i) {
        const double left = kLeft + step * static_cast<double>(i - bins.first);
        const double from = low + width * static_cast<double>(i);
        for (std::size_t s = 0; s < series.size(); ++s) {
            const double count = i < series[s].count.size() ? series[s].count[i] : 0;
            const double height = bar_height(count, bins.most);
            if (height == 0) continue;
            svg += fmt::format(
                "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\">"
                "<title>{:.4g} to {:.4g}, {}: {:.0f}</title></rect>\n",
                left + 0.08 * step + bar * static_cast<double>(s), kHeight - kBottom - height, bar, height,
                escape_html(series[s].color), from, from + width, escape_html(series[s].name), count);
        }
        svg += fmt::format(
            "<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}</text>\n", left,
            kHeight - kBottom + 16, from);
    }
    svg += fmt::format(
        "<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}</text>\n",
        kWidth - kRight, kHeight - kBottom + 16, low + width * static_cast<double>(bins.last + 1));
    return svg +
           fmt::format(
               "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{1:.1f}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/></svg>\n",
               kLeft, kWidth - kRight, kHeight - kBottom);
}

} // namespace hexopt
