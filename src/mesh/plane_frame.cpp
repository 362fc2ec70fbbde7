#include "mesh/plane_frame.hpp"

#include <fmt/format.h>

namespace hexopt {

PlaneFrame PlaneFrame::across(int axis) {
    PlaneFrame frame;
    frame.axis_ = {(axis + 1) % 3, (axis + 2) % 3, axis};
    return frame;
}

PlaneFrame PlaneFrame::turned(const glm::dmat3& axes) {
    PlaneFrame frame;
    frame.is_turned_ = true;
    frame.axes_ = axes;
    return frame;
}

Point PlaneFrame::to_plane(const Point& p) const {
    return is_turned_ ? p * axes_ : Point(p[axis_[0]], p[axis_[1]], p[axis_[2]]);
}

Point PlaneFrame::to_model(const Point& p) const {
    if (is_turned_) return axes_ * p;
    Point model;
    for (int k = 0; k < 3; ++k) model[axis_[k]] = p[k];
    return model;
}

std::string PlaneFrame::describe(const Point2& p, double third) const {
    if (axis() == 2) return fmt::format("({:.6g}, {:.6g})", p.x, p.y);
    return hexopt::describe(to_model({p, third}));
}

std::string describe(const Point& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

} // namespace hexopt
