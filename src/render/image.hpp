#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace hexopt {

/// A colour in sRGB, each part 0..1.
struct Color {
    float r = 0, g = 0, b = 0;
};

/// from at t = 0, to at t = 1.
Color mix(Color from, Color to, float t);

/// Pixels, 3 bytes each (red, green, blue), row by row from the top left.
class Image {
  public:
    Image(int width, int height, Color background);

    int width() const { return width_; }
    int height() const { return height_; }
    const std::vector<std::uint8_t>& bytes() const { return bytes_; }

    Color get(int x, int y) const;
    void set(int x, int y, Color color); ///< does nothing outside the image
    void fill(int x, int y, int width, int height, Color color);

    /// Text in capitals, 5 by 7 dots of `scale` pixels each, 6 apart; (x, y) is the top left. Characters
    /// without a glyph appear as '?'.
    void write(int x, int y, int scale, Color color, std::string_view text);

  private:
    int width_, height_;
    std::vector<std::uint8_t> bytes_;
};

inline constexpr int kGlyphWidth = 6, kGlyphHeight = 7; ///< dots, the space between letters included

} // namespace hexopt
