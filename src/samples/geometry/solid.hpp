#pragma once

#include "core/result.hpp"
#include "mesh/outline.hpp"
#include "mesh/triangle_soup.hpp"

#include <glm/mat4x4.hpp>

#include <array>
#include <memory>
#include <string>
#include <vector>

/// Building blocks of the sample geometries: solids bounded by triangles that share their vertices, closed,
/// counter-clockwise seen from outside, with a named patch for each triangle.
namespace hexopt::geometry {

using Solid = TriangleSoup;

/// A simple closed polygon, either sense, the first point not repeated. `names`: of the patch that edge i,
/// from point i to the next, sweeps out; or one name for all.
struct Loop {
    std::vector<Point2> points;
    std::vector<std::string> names;
};

/// A plane figure with holes, swept along z from `low` to `high`. Error (bad_input): loops that cross.
struct Extrusion {
    Loop outer;
    std::vector<Loop> holes;
    double low = 0, high = 1;
    std::string low_name = "bottom", high_name = "top";
};
Result<Solid> extrude(const Extrusion& shape);

/// Names in the order -x, +x, -y, +y, -z, +z.
Solid make_box(const Point& low, const Point& high, const std::array<std::string, 6>& names);

/// A profile turned about the x axis in `segments` steps: from a point on the axis (radius 0) over points
/// with radius > 0 to one on the axis, x rising or not. names: one for each profile edge, or one for all.
struct Profile {
    std::vector<Point2> points; ///< x and radius
    std::vector<std::string> names;
};
Solid revolve(const Profile& profile, int segments);

/// Sections with the same number of points, in order, joined by quads cut in two; the first and last, which
/// must be plane, become caps. Any orientation; what results points outwards. Error (bad_input): a cap
/// that crosses itself.
struct Loft {
    std::vector<std::vector<Point>> sections;
    std::vector<std::string> names; ///< of the side at each section edge, or one for all
    std::string first_name, last_name;
};
Result<Solid> loft(const Loft& shape);

/// Maps every vertex; orientation stays outward also where the map mirrors.
Solid transformed(Solid solid, const glm::dmat4& map);

/// Volume enclosed, by the divergence theorem.
double signed_volume(const Solid& solid);

/// Union, difference and intersection of solids, exact until the end. Each triangle keeps the name of the one
/// it is a piece of; patches of the same name become one.
class BooleanSolid {
  public:
    explicit BooleanSolid(const Solid& first);
    ~BooleanSolid();
    BooleanSolid(BooleanSolid&&) noexcept;

    BooleanSolid& unite(const Solid& other);
    BooleanSolid& subtract(const Solid& other);
    BooleanSolid& intersect(const Solid& other);

    /// Error (bad_input): an operation whose result is not a manifold.
    Result<Solid> finish();

  private:
    struct Exact;
    std::unique_ptr<Exact> exact_;
};

} // namespace hexopt::geometry
