#pragma once

#include "mesh/hex_mesh.hpp"
#include "quality/mesh_validity.hpp"
#include "render/rasterise.hpp"
#include "render/render_mesh.hpp"

#include <string>
#include <vector>

namespace hexopt {

/// Where the parts of a picture go.
struct Layout {
    int text_scale;    ///< pixels of a glyph's dot
    Rectangle model;   ///< the drawing itself
    Rectangle legend;  ///< right of it; width 0 where colours mean nothing
    Rectangle caption; ///< above it
};

Layout lay_out(PictureSize size, bool with_legend);

/// Lines of text, each cut to the caption's width.
void write_caption(Image& image, const Layout& layout, const std::vector<std::string>& lines);

/// Colour bar from 0 to 1 and the colour of bad cells.
void draw_quality_legend(Image& image, const Layout& layout);

struct LegendEntry {
    Color color;
    std::string name;
};

/// One swatch an entry, as many as there is room for; the last then says how many are left out.
void draw_swatches(Image& image, const Layout& layout, const std::string& title,
                   const std::vector<LegendEntry>& entries);

/// The model's axes in the lower left corner of the drawing.
void draw_axes(Image& image, const Layout& layout, const View& view, const Parallel& parallel);

/// "37734 cells, concave 1 (8-tet) 97 (24-tet), not certified 1" and the scaled Jacobian.
std::vector<std::string> quality_caption(const ValidityCounts& counts);

} // namespace hexopt
