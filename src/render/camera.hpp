#pragma once

#include "render/rasterise.hpp"
#include "render/view.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

/// Projection and light; shared by the files of src/render, not for others.
namespace hexopt {

/// Orthographic projection of model space onto a part of the picture.
class Camera {
  public:
    Camera(const View& view, Rectangle area) : view_(view), area_(area) {}

    /// Extends what must be in the picture.
    void include(const Point& p) {
        const Point q = in_view(p);
        low_ = glm::min(low_, q);
        high_ = glm::max(high_, q);
    }

    /// Pixels per model unit, with a margin around what is included.
    double scale() const {
        const Point extent = high_ - low_;
        const double room = 0.94;
        const double across = std::max(extent.x / area_.width, extent.y / area_.height);
        const double fallback = std::max(extent.z / area_.width, 1e-300);
        return room / (across > 0 ? across : fallback);
    }

    ScreenPoint project(const Point& p, double scale) const {
        const Point q = (in_view(p) - 0.5 * (low_ + high_)) * scale;
        return {area_.x + 0.5 * area_.width + q.x, area_.y + 0.5 * area_.height - q.y, q.z};
    }

    const View& view() const { return view_; }

  private:
    Point in_view(const Point& p) const {
        return {glm::dot(p, view_.right), glm::dot(p, view_.up), glm::dot(p, view_.toward)};
    }

    View view_;
    Rectangle area_;
    Point low_ = Point(std::numeric_limits<double>::max());
    Point high_ = Point(std::numeric_limits<double>::lowest());
};

/// The colour of a surface with this normal (any length) under a key light from the upper left of the viewer
/// and a weak one from the right. A surface seen from behind is dimmed.
inline Color shade(Color color, const Point& normal, const View& view) {
    Point n(glm::dot(normal, view.right), glm::dot(normal, view.up), glm::dot(normal, view.toward));
    const double length = glm::length(n);
    if (!(length > 0)) return color;
    n /= length;
    const bool from_behind = n.z < 0;
    if (from_behind) n = -n;
    const double key = std::max(0.0, glm::dot(n, glm::normalize(Point(-0.45, 0.60, 0.85))));
    const double fill = std::max(0.0, glm::dot(n, glm::normalize(Point(0.80, -0.10, 0.55))));
    const auto light = static_cast<float>((0.52 + 0.44 * key + 0.14 * fill) * (from_behind ? 0.6 : 1.0));
    const auto shine = static_cast<float>(0.06 * std::pow(key, 30));
    return {color.r * light + shine, color.g * light + shine, color.b * light + shine};
}

/// How strongly to draw edges that are this many pixels long: fully when there is room between them, not at
/// all when there is none.
inline float edge_opacity(double pixels) {
    return static_cast<float>(std::clamp((pixels - 2) / 8, 0.0, 0.75));
}

inline constexpr Color kBackground = {1.0f, 1.0f, 1.0f};
inline constexpr Color kInk = {0.13f, 0.15f, 0.18f};
inline constexpr Color kBoundaryColor = {0.80f, 0.83f, 0.87f};
inline constexpr Color kCutColor = {0.95f, 0.80f, 0.55f};

} // namespace hexopt
