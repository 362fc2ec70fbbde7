#include "render/color_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hexopt {

namespace {

template <std::size_t N>
Color interpolate(const std::array<Color, N>& stops, double t) {
    const double place = std::clamp(t, 0.0, 1.0) * (N - 1);
    const auto below = std::min(static_cast<std::size_t>(place), N - 2);
    return mix(stops[below], stops[below + 1], static_cast<float>(place - static_cast<double>(below)));
}

} // namespace

Color quality_color(double scaled_jacobian) {
    static constexpr std::array<Color, 5> kStops = {{{0.62f, 0.05f, 0.12f},
                                                     {0.94f, 0.42f, 0.20f},
                                                     {0.99f, 0.86f, 0.42f},
                                                     {0.55f, 0.83f, 0.62f},
                                                     {0.44f, 0.68f, 0.92f}}};
    return interpolate(kStops, scaled_jacobian);
}

Color level_color(int level, int deepest) {
    static constexpr std::array<Color, 4> kStops = {
        {{0.95f, 0.93f, 0.80f}, {0.60f, 0.82f, 0.72f}, {0.25f, 0.60f, 0.76f}, {0.36f, 0.32f, 0.66f}}};
    return interpolate(kStops, deepest > 0 ? static_cast<double>(level) / deepest : 0.0);
}

Color patch_color(std::size_t patch) {
    // Hues a golden section apart never come close to those of the few patches before.
    const double hue = std::fmod(0.58 + 0.6180339887498949 * static_cast<double>(patch), 1.0);
    const auto part = [&](double shift) {
        const double wave = std::abs(std::fmod(hue + shift, 1.0) * 6 - 3) - 1;
        return static_cast<float>(0.50 + 0.42 * std::clamp(wave, 0.0, 1.0));
    };
    return {part(0), part(2.0 / 3), part(1.0 / 3)};
}

} // namespace hexopt
