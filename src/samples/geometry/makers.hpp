#pragma once

#include "samples/geometry/geometries.hpp"
#include "samples/geometry/solid.hpp"

/// One function a geometry; `options` with the defaults filled in.
namespace hexopt::geometry {

// pipes.cpp
Result<Solid> make_cylinder(const GeometryOptions& options, Context& context);
Result<Solid> make_three_pipe_joint(const GeometryOptions& options, Context& context);
Result<Solid> make_volute(const GeometryOptions& options, Context& context);

// vehicles.cpp
Result<Solid> make_missile(const GeometryOptions& options, Context& context);
Result<Solid> make_ahmed(const GeometryOptions& options, Context& context);
Result<Solid> make_front_wing(const GeometryOptions& options, Context& context);
Result<Solid> make_tire_gap(const GeometryOptions& options, Context& context);

// wings.cpp
Result<Solid> make_airfoil_slab(const GeometryOptions& options, Context& context);
Result<Solid> make_multi_element_slab(const GeometryOptions& options, Context& context);
Result<Solid> make_cooled_blade(const GeometryOptions& options, Context& context);
Result<Solid> make_wing(const GeometryOptions& options, Context& context);
Result<Solid> make_business_jet(const GeometryOptions& options, Context& context);
Result<Solid> make_wing_body(const GeometryOptions& options, Context& context);

/// A wing or fin between straight edges: sections of an outline of chord 1, along a span in `steps` pieces.
struct WingShape {
    std::vector<Point2> outline;              ///< chord from (0, 0) to (1, 0)
    Point root, tip;                          ///< leading edge of the first and last section
    double root_chord = 1, tip_chord = 1;     ///< along x
    double root_twist_deg = 0, twist_deg = 0; ///< nose up, of the first and last section
    Point up = Point(0, 0, 1);                ///< direction of the outline's y
    int steps = 8;
    std::string name, tip_name;
};
Result<Solid> make_wing_solid(const WingShape& shape);

} // namespace hexopt::geometry
