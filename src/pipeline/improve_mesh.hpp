#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "domain/deviation.hpp"
#include "mesh/feature_lines.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/triangle_soup.hpp"
#include "pipeline/compute_place.hpp"
#include "pipeline/flatten_faces.hpp"
#include "pipeline/stage_clock.hpp"
#include "quality/mesh_quality.hpp"
#include "stages/optimize/optimize.hpp"

#include <optional>
#include <string>
#include <vector>

namespace hexopt {

struct ImproveOptions {
    OptimizeOptions optimize;
    BoundaryOptions features;                ///< how features of the boundary are recognised
    std::vector<FeatureLines> feature_lines; ///< features whatever their angle
    double feature_reach_rel = 1e-3;       ///< how far they may be from the surface, of its diagonal; 0..0.01
    const TriangleSoup* surface = nullptr; ///< what the boundary slides on; null: the mesh's own boundary
    ComputeRequest compute;
    std::optional<double> target_min_sj; ///< a minimum scaled Jacobian that the caller insists on
    /// Flattens faces that solvers cannot cut into tetrahedra (flatten_faces()): no cell becomes worse than
    /// it was and than the worst of the optimized mesh, and no quad comes farther from the surface.
    bool flatten = false;
};

/// What became of a mesh.
struct ImproveOutcome {
    /// ok, no_valid_mesh, below_target or cancelled: in all of these the mesh is the best state reached.
    ErrorCode verdict = ErrorCode::ok;
    std::string device;                 ///< where it was computed, and why there
    std::size_t recognised_hanging = 0; ///< hanging vertices found that the input did not name
    QualityReport before, after;
    std::optional<OptimizeStats> stats; ///< none where cancelled
    std::optional<Deviation>
        deviation; ///< of the final boundary from the surface; none with a fixed boundary
    std::optional<FlattenReport> warped; ///< where asked for and not cancelled
    std::vector<std::string> notes;      ///< what the user should know, one sentence each
};

/// The flow in memory: recognises hanging vertices, measures, optimizes and measures again. The mesh must be
/// structurally valid. On an Error the positions are as they were. Errors: bad_input (no hexahedra, a surface
/// that cannot be used, feature lines off it), out_of_memory, device, cancelled before the optimizer began.
Result<ImproveOutcome> improve_mesh(HexMesh& mesh, const ImproveOptions& options, StageClock& clock,
                                    Context& context);

} // namespace hexopt
