#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace hexopt {

/// A parametric surface that the project generates itself: closed, manifold, counter-clockwise seen from
/// outside of what is to be meshed, patches named. Bodies in a flow come inside their outer box.
struct GeometryInfo {
    std::string_view name;
    std::string_view description; ///< one line
    int default_size;             ///< segments of a full circle, or points along each side of an airfoil
    bool takes_airfoil;
};

struct GeometryOptions {
    int size = 0;        ///< segments of a full circle, 12..720; 0: the sample's default
    std::string airfoil; ///< NACA code of 4 or 5 digits, or a file of coordinates; empty: the sample's own
};

/// All geometries, in the order of the documentation.
const std::vector<GeometryInfo>& geometry_infos();
std::vector<std::string> geometry_names();
bool is_geometry_name(std::string_view name);

/// Makes one; the same options give the same triangles on every machine. Units: metres, in the size of the
/// real thing where there is one. Errors (usage): unknown name, options out of range or of another sample;
/// bad_input: a file of coordinates that cannot be used.
Result<TriangleSoup> make_geometry(std::string_view name, const GeometryOptions& options, Context& context);

} // namespace hexopt
