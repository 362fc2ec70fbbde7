#pragma once

#include "domain/boundary_model.hpp"
#include "domain/box_tree.hpp"
#include "mesh/feature_lines.hpp"
#include "pipeline/compute_place.hpp"
#include "stages/buffer/buffer.hpp"
#include "stages/fit/fit.hpp"
#include "stages/optimize/optimize.hpp"
#include "stages/refine/refine.hpp"
#include "stages/trim/trim.hpp"

#include <optional>

namespace hexopt {

/// Whether a surface is meshed in the plane, one cell thick (docs/planar.md).
enum class PlanarChoice : std::uint8_t {
    automatic, ///< where it is a thin slab
    yes,       ///< it must be a slab
    no,
};

/// What meshing a surface may be told; each stage's own options, and what holds them together.
struct MeshOptions {
    BoundaryOptions features = [] {
        BoundaryOptions sharp;
        sharp.feature_angle_deg = 30;
        return sharp;
    }();
    /// Whether long creases below the feature angle are followed too where quads across them would leave the
    /// surface by more than refine.chord_error_rel (find_weak_creases()). Not where the surface's size is
    /// given as a level.
    bool weak_features = true;
    /// Features that are blunter than this all along are given up where cells fail at a quarter of their
    /// vertices, and not where feature_lines are given; degrees, 0 (none) to 180.
    double noise_angle_deg = 60;
    /// Of two features that meet at next to no angle the blunter one is given up where they are nearer than
    /// this many cells of the octree, if it is blunter than noise_angle_deg; both are, however sharp, where
    /// they bound a ledge of half of that. Not where feature_lines are given; 0 (nowhere) to 1.
    double narrow_cells = 0.3;
    std::vector<FeatureLines> feature_lines; ///< features whatever their angle
    /// How far these may be from the surface, as a fraction of its diagonal; 0..0.01.
    double feature_reach_rel = 1e-3;
    /// Gaps in the surface up to this fraction of its diagonal are closed; 0..0.01.
    double weld_rel = 1e-4;
    /// External flow: a box round the surface, which becomes the outer boundary (patches farfield_x_min,
    /// ...). Planar: x and y are bounds along the model's axes in the plane, in their order; z goes from
    /// minus to plus infinity.
    std::optional<Box> farfield;
    PlanarChoice planar = PlanarChoice::automatic;
    double thickness = 0; ///< of meshes of outlines, model units; 0: a hundredth of their diagonal
    RefineOptions refine;
    TrimOptions trim;
    FitOptions fit;
    int fit_repairs = 3; ///< how often cells round features that fitting could not capture are refined; 0..5
    /// How often the octree is refined round cells that are not valid on the surface or where the boundary
    /// touches itself, and meshed anew, before such places may leave the surface; 0..10.
    int repairs = 4;
    bool buffers = true;
    BufferOptions buffer;
    /// max_deviation_rel: the farthest that vertices round bad cells may end from the surface
    /// (settle_mesh()); they go no farther than validity asks for, mostly less than a cell.
    OptimizeOptions optimize = [] {
        OptimizeOptions fitted;
        fitted.effort = Effort::quick;
        fitted.fresh_boundary = true;
        fitted.min_sj = 0.3;
        fitted.max_deviation_rel = 0.1;
        return fitted;
    }();
    /// Where attempts are optimized on the surface; what settles them is computed by the host. Devices do not
    /// know the sizes of cells, and parts of a few thousand cells do not fill them.
    ComputeRequest compute = {"cpu"};
    /// Whether boundary vertices are moved onto the exact faces, edges and vertices of CAD files at the end.
    bool cad_projection = true;
    std::optional<double> target_min_sj; ///< a minimum scaled Jacobian that the caller insists on
};

} // namespace hexopt
