#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"

namespace hexopt {

struct DeviationOptions {
    /// A maximum is bracketed to within this fraction of itself, 0..1 ...
    double tolerance = 0.01;
    /// ... or this fraction of the surface's diagonal, whichever is more; > 0.
    double tolerance_rel = 1e-6;
    /// Closest-point queries a direction, at least one a triangle is made; then the bracket stays wider.
    std::size_t max_queries = 4000000;
};

/// Largest distance from one set to another, bracketed: attained `at`, and certainly nowhere above `upper`.
struct DirectedDeviation {
    double largest = 0; ///< model units; at most the true maximum
    double upper = 0;   ///< model units; at least the true maximum
    double rms = 0;     ///< model units; by area (length) over the centres of the given pieces
    Point at = {};
    /// Boundary face (place in Topology::boundary_faces), triangle of the model, feature edge or segment.
    Index element = kNoIndex;
};

/// How far the boundary of a mesh and a surface are apart. Quads are taken like the model's own
/// (BoundaryModel::quad_tolerance), so a mesh deviates from its own boundary by exactly 0.
struct Deviation {
    DirectedDeviation mesh_to_surface, surface_to_mesh;
    /// Between the mesh edges that follow the model's curves and those curves; 0 without features.
    DirectedDeviation mesh_to_curves, curves_to_mesh;
    double largest_corner_distance = 0; ///< of the vertices bound to corners, model units
    /// Largest distance between a quad's bilinear patch and the triangles that it was measured as, model
    /// units.
    double bilinear_gap = 0;
    double diagonal = 0; ///< of the surface
    /// Of both surfaces' area, by samples (percentage_within_tenth()); 0..100.
    double within_tenth_h_pct = 100;

    double largest() const { return std::max(mesh_to_surface.largest, surface_to_mesh.largest); }
    double largest_rel() const { return diagonal > 0 ? largest() / diagonal : 0; }
    double feature_largest() const {
        return std::max({mesh_to_curves.largest, curves_to_mesh.largest, largest_corner_distance});
    }
};

/// Two-sided distance between the boundary of `mesh`, whose vertices the model was built for (positions may
/// have changed since, connectivity not), and the model's surface. Branch and bound over triangles: the
/// distance to a convex piece is convex, which bounds it over a triangle from the corners (after Tang, Lee,
/// Kim 2009, Interactive Hausdorff distance computation). Errors: cancelled; bad_input where a boundary
/// vertex is not finite.
Result<Deviation> measure_deviation(const HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                    const DeviationOptions& options, Context& context);

} // namespace hexopt
