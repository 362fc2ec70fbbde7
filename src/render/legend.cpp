#include "render/legend.hpp"

#include "render/camera.hpp"
#include "render/color_map.hpp"

#include <fmt/format.h>

namespace hexopt {

namespace {

int line_height(int scale) { return (kGlyphHeight + 4) * scale; }

std::string cut_to(const std::string& text, int width, int scale) {
    const auto room = static_cast<std::size_t>(std::max(0, width / (kGlyphWidth * scale)));
    return text.substr(0, room);
}

} // namespace

Layout lay_out(PictureSize size, bool with_legend) {
    Layout layout{};
    layout.text_scale = std::max(1, std::min(size.width / 640, size.height / 400));
    const int s = layout.text_scale, margin = 6 * s;
    const int legend_width = with_legend ? std::min(size.width / 3, 15 * kGlyphWidth * s) : 0;
    const int caption_height = std::min(size.height / 4, 2 * line_height(s) + margin);
    layout.caption = {margin, margin, size.width - 2 * margin, caption_height};
    layout.legend = {size.width - legend_width, caption_height + margin, legend_width,
                     size.height - caption_height - 2 * margin};
    layout.model = {0, caption_height, size.width - legend_width, size.height - caption_height};
    return layout;
}

void write_caption(Image& image, const Layout& layout, const std::vector<std::string>& lines) {
    int y = layout.caption.y;
    for (const std::string& line : lines) {
        image.write(layout.caption.x, y, layout.text_scale, kInk,
                    cut_to(line, layout.caption.width, layout.text_scale));
        y += line_height(layout.text_scale);
    }
}

void draw_quality_legend(Image& image, const Layout& layout) {
    const int s = layout.text_scale, x = layout.legend.x, width = 10 * s;
    int y = layout.legend.y;
    for (const char* line : {"scaled", "Jacobian"}) {
        image.write(x, y, s, kInk, line);
        y += line_height(s);
    }
    y += 6 * s;
    const int height = std::max(11, std::min(layout.legend.height / 2, 160 * s));
    for (int row = 0; row < height; ++row)
        image.fill(x, y + row, width, 1, quality_color(1 - row / (height - 1.0)));
    for (int tick = 0; tick <= 10; tick += 2) {
        const int at = y + (10 - tick) * (height - 1) / 10;
        image.fill(x + width, at, 3 * s, std::max(1, s / 2), kInk);
        image.write(x + width + 5 * s, at - kGlyphHeight * s / 2, s, kInk,
                    fmt::format("{:.1f}", tick / 10.0));
    }
    y += height + 10 * s;
    image.fill(x, y, width, width, kBadColor);
    image.write(x + width + 5 * s, y + s, s, kInk, "concave");
    image.write(x + width + 5 * s, y + s + line_height(s), s, kInk, "or not");
    image.write(x + width + 5 * s, y + s + 2 * line_height(s), s, kInk, "valid");
}

void draw_swatches(Image& image, const Layout& layout, const std::string& title,
                   const std::vector<LegendEntry>& entries) {
    const int s = layout.text_scale, x = layout.legend.x, width = 10 * s, step = 14 * s;
    int y = layout.legend.y;
    image.write(x, y, s, kInk, title);
    y += line_height(s) + 4 * s;
    const auto room =
        static_cast<std::size_t>(std::max(1, (layout.legend.y + layout.legend.height - y) / step));
    for (std::size_t i = 0; i < entries.size(); ++i, y += step) {
        if (i + 1 == room && entries.size() > room) {
            image.write(x, y + s, s, kInk, fmt::format("+{} more", entries.size() - i));
            return;
        }
        image.fill(x, y, width, width, entries[i].color);
        image.write(x + width + 5 * s, y + s, s, kInk,
                    cut_to(entries[i].name, layout.legend.width - width - 5 * s, s));
    }
}

void draw_axes(Image& image, const Layout& layout, const View& view, const Parallel& parallel) {
    const int s = layout.text_scale, reach = 26 * s;
    const ScreenPoint origin(layout.model.x + 40 * s, layout.model.y + layout.model.height - 40 * s, 0);
    const Color colors[3] = {{0.80f, 0.15f, 0.15f}, {0.10f, 0.55f, 0.15f}, {0.15f, 0.30f, 0.80f}};
    Scene scene;
    for (int axis = 0; axis < 3; ++axis) {
        const Point d(view.right[axis], -view.up[axis], view.toward[axis]);
        scene.lines.push_back(
            {origin, origin + d * double(reach), colors[axis], 1.6f * static_cast<float>(s)});
    }
    const Rectangle corner{layout.model.x,
                           std::max(layout.model.y, layout.model.y + layout.model.height - 80 * s),
                           std::min(80 * s, layout.model.width), std::min(80 * s, layout.model.height)};
    rasterise(scene, corner, image, parallel);
    for (int axis = 0; axis < 3; ++axis) {
        const double right = view.right[axis], up = view.up[axis];
        if (std::hypot(right, up) < 0.2) continue; // points at the viewer: no room for its letter
        const double out = reach + 7.0 * s;
        image.write(static_cast<int>(std::lround(origin.x + right * out - 2.5 * s)),
                    static_cast<int>(std::lround(origin.y - up * out - 3.5 * s)), s, colors[axis],
                    std::string(1, static_cast<char>('x' + axis)));
    }
}

std::vector<std::string> quality_caption(const ValidityCounts& v) {
    return {fmt::format("{} cells  scaled Jacobian min {:.4f} mean {:.4f}", v.cells, v.min_scaled_jacobian,
                        v.mean_scaled_jacobian),
            v.is_valid() ? std::string("all valid")
                         : fmt::format("concave {} (8-tet) {} (24-tet)  not certified {}", v.concave8_cells,
                                       v.concave24_cells, v.cells - v.valid)};
}

} // namespace hexopt
