#pragma once

#include "core/csr.hpp"
#include "core/types.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/triangle_soup.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// An edge of a triangulated surface at which its normal turns.
struct Crease {
    std::array<Index, 2> vertex;   ///< smaller first
    std::array<Index, 2> triangle; ///< beside it, smaller first
    double turn;                   ///< angle between their normals, radians, 0..pi
    /// How far the surface goes on from the edge on either side, square to it, until it turns by more than a
    /// third of `turn` again, comes to an edge that has not two triangles, or reaches the limit that was
    /// asked for; model units, the least of three places of the edge. In the order of `triangle`.
    std::array<double, 2> width;
};

/// Farthest that a chord across the crease leaves the surface, model units: one of length `size` at the most.
double chord_distance(const Crease& crease, double size);

/// Creases of more than least_turn (radians), by vertices. triangles: consistently oriented where they share
/// an edge, else their edges are left out. normal: unit, per triangle, or zero where it has no area.
/// farthest: widths are not followed beyond, model units.
std::vector<Crease> find_creases(std::span<const Point> vertices,
                                 std::span<const std::array<Index, 3>> triangles,
                                 std::span<const Point> normal, double least_turn, double farthest);

/// Creases inside the patches of a model.
struct PatchCreases {
    std::vector<Crease> crease;             ///< triangles are numbered as the model's
    std::vector<std::array<Point, 2>> ends; ///< of each
    Csr<Index> of_triangle;                 ///< per triangle: its edges among them
};

/// As find_creases(), for the triangles of a model, without the borders of its patches.
PatchCreases find_patch_creases(const BoundaryModel& model, double least_turn, double farthest);

/// Which creases below the feature angle are features nevertheless.
struct WeakCreaseLimits {
    double size = 0;     ///< of the cells expected, model units
    double distance = 0; ///< that a quad of this size may leave the surface by, model units
};

/// Edges that are no features by angle but long, between faces that stay flat for several cells, and such
/// that quads across them would leave the surface by more than limits.distance: to be followed like features.
/// Chains of them are continued to the next feature where the crease goes on. Pairs of vertices of the soup.
/// The soup's triangles need not be clean. Errors (bad_input) as clean_surface().
Result<std::vector<std::array<Index, 2>>> find_weak_creases(const TriangleSoup& surface,
                                                            const BoundaryOptions& options,
                                                            const WeakCreaseLimits& limits);

} // namespace hexopt
