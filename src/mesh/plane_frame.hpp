#pragma once

#include "core/types.hpp"

#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <string>

namespace hexopt {

using Point2 = glm::dvec2; ///< place in the plane, model units

/// How a plane lies in the model: coordinates of its frame are two in the plane and the third across,
/// right-handed. Planes of constant x, y or z take the model's axes in turn (y z x, z x y or x y z), so that
/// coordinates keep their bits; all others are turned.
class PlaneFrame {
  public:
    PlaneFrame() = default; ///< planes of constant z: the model's own frame
    static PlaneFrame across(int axis);
    /// Columns: two directions in the plane and its normal, orthonormal and right-handed.
    static PlaneFrame turned(const glm::dmat3& axes);

    /// The model's axis that the planes are across: 0..2; none where they are turned.
    std::optional<int> axis() const { return is_turned_ ? std::nullopt : std::optional(axis_[2]); }
    Point normal() const { return to_model({0, 0, 1}); }
    Point to_plane(const Point& p) const;
    Point to_model(const Point& p) const;
    /// A place in the plane with this third coordinate, for messages: "(X, Y)", or all three coordinates of
    /// the model where the plane is not one of constant z.
    std::string describe(const Point2& p, double third) const;

  private:
    bool is_turned_ = false;
    std::array<int, 3> axis_ = {0, 1, 2};
    glm::dmat3 axes_ = glm::dmat3(1);
};

/// "(X, Y, Z)" with six digits, for messages.
std::string describe(const Point& p);

} // namespace hexopt
