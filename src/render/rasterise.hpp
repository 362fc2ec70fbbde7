#pragma once

#include "core/parallel.hpp"
#include "core/types.hpp"
#include "render/image.hpp"

#include <array>
#include <vector>

namespace hexopt {

/// A point on the picture: x to the right and y down in pixels of the image, z towards the viewer.
using ScreenPoint = Point;

struct ScreenQuad {
    std::array<ScreenPoint, 4> corner;
    Color fill;
    float edge_opacity = 0; ///< 0..1: how strongly the quad's four edges are drawn
    float edge_width = 1;   ///< pixels; half of it lies inside the quad
};

struct ScreenLine {
    ScreenPoint from, to;
    Color color;
    float width = 1; ///< pixels
};

struct Scene {
    std::vector<ScreenQuad> quads;
    std::vector<ScreenLine> lines;
};

/// A part of an image, in pixels.
struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Draws the scene over what is in `area` of the image, nearest first, with 3 by 3 samples a pixel. Quads are
/// drawn as two triangles. The same bits for any number of threads.
void rasterise(const Scene& scene, Rectangle area, Image& image, const Parallel& parallel);

} // namespace hexopt
