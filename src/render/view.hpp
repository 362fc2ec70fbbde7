#pragma once

#include "core/result.hpp"
#include "core/types.hpp"

#include <string>
#include <vector>

namespace hexopt {

/// An orthographic view: unit vectors of the picture's axes in model space.
struct View {
    Point right, up, toward; ///< toward: from the model to the viewer
};

/// azimuth_deg: of the viewer around z from +x towards +y; elevation_deg: above the xy plane, -90..90. Up is
/// z (from above and below: y).
View make_view(double azimuth_deg, double elevation_deg);

/// "iso"; "x", "y", "z", "-x", "-y", "-z": the side of the viewer; or "azimuth,elevation" in degrees. Error:
/// usage.
Result<View> parse_view(const std::string& text);

/// Keeps the cells on one side of a plane across an axis, whole (a crinkle cut).
struct Clip {
    int axis = 0;            ///< 0, 1, 2
    double fraction = 0.5;   ///< of the mesh's bounding box, 0..1
    bool keep_above = false; ///< keep cells with their centre above the plane instead of below
};

/// "x=0.5" keeps what is below half of the box along x, "-x=0.5" what is above. Error: usage.
Result<Clip> parse_clip(const std::string& text);

struct PictureSize {
    int width = 1600, height = 1200; ///< pixels, 64..16384 each
};

/// "1600x1200". Error: usage.
Result<PictureSize> parse_picture_size(const std::string& text);

} // namespace hexopt
