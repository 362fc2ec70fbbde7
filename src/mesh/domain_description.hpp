#pragma once

#include "core/types.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace hexopt {

/// What is meshed as a domain file states it: topology, and apart from it the geometry that it leans on
/// (thesis section 3.2). Entities bear the file's numbers, which need not be dense nor in order. Nothing is
/// promised about consistency: build_domain() checks it.
struct DomainDescription {
    struct Entity {
        std::int64_t number = 0; ///< 1 or more, among the entities of its kind
        std::size_t line = 0;    ///< of `file`, 1-based; 0: not from a file
    };
    struct Corner : Entity {
        Point position = {};
        bool alone = false; ///< ends no curve and is a corner nevertheless
    };
    struct Curve : Entity {
        std::optional<std::array<std::int64_t, 2>> ends; ///< corners; none: a loop without a corner
        std::vector<std::int64_t> patches;               ///< beside it
        bool open = false;                               ///< an edge of it has not exactly two triangles
        /// Smallest and largest dihedral angle, degrees, 0..360; none: from the triangles beside it.
        std::optional<std::array<double, 2>> angle_deg;
        std::vector<std::int64_t> polylines; ///< one after the other, each in either direction
    };
    struct Patch : Entity {
        std::string name;
        std::vector<std::int64_t> surfaces;
    };
    struct Polyline : Entity {
        std::vector<Point> points; ///< model units; a closed one repeats its first point
    };
    struct Surface : Entity {
        std::vector<Point> points;                   ///< model units
        std::vector<std::array<Index, 3>> triangles; ///< of `points`, counter-clockwise seen from outside
    };

    std::string file;               ///< for messages; may be empty
    std::vector<std::string> names; ///< order of the patches' names in meshes; those missing follow
    std::vector<Corner> corners;
    std::vector<Curve> curves;
    std::vector<Patch> patches;
    std::vector<Polyline> polylines;
    std::vector<Surface> surfaces;
};

} // namespace hexopt
