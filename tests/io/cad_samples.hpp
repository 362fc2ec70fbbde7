#pragma once

#include <string>

/// CAD files made by OpenCASCADE for the tests; bytes as a program would write them.
namespace hexopt::test {

std::string step_of_box();      ///< 2 x 3 x 4, faces named "inlet", "wall", "wall" and no name
std::string step_of_cylinder(); ///< radius 1, height 3, all faces red
std::string step_in_metres();   ///< the box in metres
std::string step_of_assembly(); ///< a mirrored and a moved unit cube
std::string step_of_sphere();   ///< radius 2: one face with a seam and two poles
std::string step_of_nose();     ///< quarters of an ellipse of half axes 2 and 0.1 above and below, 1 wide
std::string step_of_wire();     ///< an edge only
std::string iges_of_cylinder(); ///< trimmed surfaces that share nothing
std::string brep_of_torus();    ///< radii 3 and 1
std::string brep_of_spline();   ///< an extruded B-spline outline

} // namespace hexopt::test
