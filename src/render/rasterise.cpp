#include "render/rasterise.hpp"

#include "core/csr.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexopt {

namespace {

constexpr int kSamples = 3;   ///< along each axis of a pixel
constexpr int kBandRows = 16; ///< rows of pixels that are drawn together

/// Samples of a band of rows, in a grid of kSamples times the pixels.
struct Band {
    Rectangle area; ///< pixels
    int columns, rows;
    std::vector<float> depth;
    std::vector<Color> color;

    Band(Rectangle pixels, const Image& image)
        : area(pixels), columns(pixels.width * kSamples), rows(pixels.height * kSamples),
          depth(static_cast<std::size_t>(columns) * rows, -std::numeric_limits<float>::infinity()),
          color(depth.size()) {
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x)
                color[static_cast<std::size_t>(y) * columns + x] =
                    image.get(area.x + x / kSamples, area.y + y / kSamples);
    }

    void resolve(Image& image) const {
        for (int y = 0; y < area.height; ++y)
            for (int x = 0; x < area.width; ++x) {
                Color sum;
                for (int s = 0; s < kSamples * kSamples; ++s) {
                    const Color& c = color[static_cast<std::size_t>(y * kSamples + s / kSamples) * columns +
                                           x * kSamples + s % kSamples];
                    sum = {sum.r + c.r, sum.g + c.g, sum.b + c.b};
                }
                const float share = 1.0f / (kSamples * kSamples);
                image.set(area.x + x, area.y + y, {sum.r * share, sum.g * share, sum.b * share});
            }
    }
};

double distance_to_segment(double x, double y, const ScreenPoint& a, const ScreenPoint& b) {
    const double dx = b.x - a.x, dy = b.y - a.y, length2 = dx * dx + dy * dy;
    const double t = length2 > 0 ? std::clamp(((x - a.x) * dx + (y - a.y) * dy) / length2, 0.0, 1.0) : 0;
    return std::hypot(x - a.x - t * dx, y - a.y - t * dy);
}

/// Calls draw(sample index, x, y, depth) for the samples of a triangle that are in front of what is there.
template <class Draw>
void visit_triangle(Band& band, const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c,
                    const Draw& draw) {
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area == 0 || !std::isfinite(area)) return;
    const auto sample = [&](double pixel, int origin) { return (pixel - origin) * kSamples - 0.5; };
    const auto first = [&](double low, int origin) {
        return static_cast<int>(std::max(0.0, std::ceil(sample(low, origin))));
    };
    const auto last = [&](double high, int origin, int count) {
        return static_cast<int>(std::min(count - 1.0, std::floor(sample(high, origin))));
    };
    const int x0 = first(std::min({a.x, b.x, c.x}), band.area.x);
    const int x1 = last(std::max({a.x, b.x, c.x}), band.area.x, band.columns);
    const int y0 = first(std::min({a.y, b.y, c.y}), band.area.y);
    const int y1 = last(std::max({a.y, b.y, c.y}), band.area.y, band.rows);
    for (int j = y0; j <= y1; ++j) {
        const double y = band.area.y + (j + 0.5) / kSamples;
        for (int i = x0; i <= x1; ++i) {
            const double x = band.area.x + (i + 0.5) / kSamples;
            const double u = ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x)) / area;
            const double v = ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x)) / area;
            const double w = 1 - u - v;
            if (u < 0 || v < 0 || w < 0) continue;
            const auto depth = static_cast<float>(u * a.z + v * b.z + w * c.z);
            const std::size_t index = static_cast<std::size_t>(j) * band.columns + i;
            if (depth > band.depth[index]) {
                band.depth[index] = depth;
                draw(index, x, y);
            }
        }
    }
}

/// Share of a line `width` wide that covers a sample `distance` from its middle.
float coverage(double distance, float width) {
    return static_cast<float>(std::clamp((0.5 * width - distance) * kSamples + 0.5, 0.0, 1.0));
}

void draw_quad(Band& band, const ScreenQuad& quad) {
    const auto& p = quad.corner;
    const Color dark = mix(quad.fill, Color{0.04f, 0.05f, 0.08f}, 0.85f);
    const auto draw = [&](std::size_t index, double x, double y) {
        float line = 0;
        if (quad.edge_opacity > 0) {
            double distance = distance_to_segment(x, y, p[0], p[1]);
            for (int e = 1; e < 4; ++e)
                distance = std::min(distance, distance_to_segment(x, y, p[e], p[(e + 1) % 4]));
            line = quad.edge_opacity * coverage(distance, quad.edge_width);
        }
        band.color[index] = mix(quad.fill, dark, line);
    };
    visit_triangle(band, p[0], p[1], p[2], draw);
    visit_triangle(band, p[0], p[2], p[3], draw);
}

void draw_line(Band& band, const ScreenLine& line) {
    double dx = line.to.x - line.from.x, dy = line.to.y - line.from.y;
    const double length = std::hypot(dx, dy);
    if (length == 0) return;
    const double reach = 0.5 * line.width / length;
    const ScreenPoint across(-dy * reach, dx * reach, 0);
    const ScreenPoint a = line.from - across, b = line.from + across, c = line.to + across,
                      d = line.to - across;
    const auto draw = [&](std::size_t index, double, double) { band.color[index] = line.color; };
    visit_triangle(band, a, b, c, draw);
    visit_triangle(band, a, c, d, draw);
}

/// Which of `count` primitives, whose rows row_range(i) gives, touch each band.
template <class RowRange>
Csr<Index> bin_by_band(std::size_t count, Rectangle area, std::size_t bands, const RowRange& row_range) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> range(count); // first band, one after the last
    Csr<Index> csr;
    csr.offset.assign(bands + 1, 0);
    for (std::size_t i = 0; i < count; ++i) {
        const auto [top, bottom] = row_range(i);
        if (!(bottom >= area.y && top <= area.y + area.height)) continue; // outside, or not a number
        const double from = std::max(0.0, std::floor((top - area.y) / kBandRows));
        const double to = std::min(bands - 1.0, std::floor((bottom - area.y) / kBandRows));
        range[i] = {static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to) + 1};
        for (std::uint32_t b = range[i].first; b < range[i].second; ++b) ++csr.offset[b + 1];
    }
    for (std::size_t b = 0; b < bands; ++b) csr.offset[b + 1] += csr.offset[b];
    csr.item.resize(csr.offset.back());
    std::vector<std::size_t> next(csr.offset.begin(), csr.offset.end() - 1);
    for (std::size_t i = 0; i < count; ++i)
        for (std::uint32_t b = range[i].first; b < range[i].second; ++b)
            csr.item[next[b]++] = static_cast<Index>(i);
    return csr;
}

} // namespace

void rasterise(const Scene& scene, Rectangle area, Image& image, const Parallel& parallel) {
    const auto bands = static_cast<std::size_t>((area.height + kBandRows - 1) / kBandRows);
    const Csr<Index> quads = bin_by_band(scene.quads.size(), area, bands, [&](std::size_t i) {
        const auto& p = scene.quads[i].corner;
        return std::pair(std::min({p[0].y, p[1].y, p[2].y, p[3].y}),
                         std::max({p[0].y, p[1].y, p[2].y, p[3].y}));
    });
    const Csr<Index> lines = bin_by_band(scene.lines.size(), area, bands, [&](std::size_t i) {
        const ScreenLine& line = scene.lines[i];
        return std::pair(std::min(line.from.y, line.to.y) - line.width,
                         std::max(line.from.y, line.to.y) + line.width);
    });
    parallel.for_each(bands, 1, [&](std::size_t b) {
        const int top = static_cast<int>(b) * kBandRows;
        Band band({area.x, area.y + top, area.width, std::min(kBandRows, area.height - top)}, image);
        for (Index i : quads[b]) draw_quad(band, scene.quads[i]);
        for (Index i : lines[b]) draw_line(band, scene.lines[i]);
        band.resolve(image);
    });
}

} // namespace hexopt
