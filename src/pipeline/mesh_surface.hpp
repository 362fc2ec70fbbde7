#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/deviation.hpp"
#include "domain/outline_regions.hpp"
#include "mesh/triangle_soup.hpp"
#include "pipeline/flatten_faces.hpp"
#include "pipeline/mesh_options.hpp"
#include "pipeline/prepare_domain.hpp"
#include "pipeline/reach_features.hpp"
#include "pipeline/settle_mesh.hpp"
#include "pipeline/stage_clock.hpp"
#include "quality/mesh_quality.hpp"
#include "stages/planar/planar.hpp"

#include <optional>
#include <string>
#include <vector>

namespace hexopt {

/// What is special to a planar mesh.
struct PlanarReport {
    std::size_t loops = 0; ///< of the outline, meshed
    RegionReport regions;
    Point normal = Point(0, 0, 1);          ///< of the planes
    double low = 0, high = 0;               ///< their distances from the origin along it
    double diagonal = 0;                    ///< of the bodies, without the farfield round them
    std::vector<std::string> plane_patches; ///< the plane sides
    bool is_turned = false;                 ///< the planes are none of constant x, y or z
    WallRowReport row;
    RelaxReport relax; ///< of the last round
};

/// One meshing of an octree.
struct AttemptCount {
    std::size_t cells = 0;   ///< of the mesh
    std::size_t failed = 0;  ///< of these not valid on the surface, or where the boundary touches itself
    std::size_t low = 0;     ///< of the others with a scaled Jacobian below 0.2
    std::size_t refined = 0; ///< octree cells split round them for the next attempt
};

/// What became of a surface.
struct MeshOutcome {
    /// ok, no_valid_mesh, below_target or cancelled (while optimizing): the mesh is the best state reached.
    ErrorCode verdict = ErrorCode::ok;
    std::string device; ///< where attempts were optimized, and why there; empty: planar, by the host
    HexMesh mesh;       ///< with levels, hanging constraints and the input's patches

    WeldReport weld;
    OrientationReport orientation;
    std::size_t left_out_bodies = 0; ///< closed surfaces that bound nothing that the seeds are in
    std::size_t followed_borders =
        0; ///< smooth, between faces of a CAD file, that are features (follow_borders())
    std::size_t patches = 0, curves = 0, corners = 0; ///< of the domain
    std::size_t dropped_triangles = 0, open_edges = 0, nonmanifold_edges = 0;
    RefineStats refine;
    TrimReport trim;
    int trim_rounds = 0; ///< times that cells were trimmed
    FitReport fit;       ///< of the domain without narrow_curves and dropped_curves
    /// Curves of the domain, cut where need be, that were given up at cusps and ledges
    /// (MeshOptions::narrow_cells).
    std::vector<Index> narrow_curves;
    /// Curves of the domain that were given up as noise where cells failed (MeshOptions::noise_angle_deg).
    std::vector<Index> dropped_curves;
    int fit_rounds = 0;                 ///< times that the boundary was fitted
    std::vector<AttemptCount> attempts; ///< more than one: the octree was refined round what failed
    std::optional<BufferReport> buffer;
    std::optional<PlanarReport> planar; ///< where it was meshed in the plane
    QualityReport before, after;        ///< before and after the optimizer
    std::optional<OptimizeStats> stats; ///< none where cancelled
    SettleReport settle;
    std::optional<ReachReport> reached; ///< none where cancelled before its end, and where planar
    /// Boundary quads where the boundary touches or crosses itself; any makes the mesh not valid.
    std::vector<Index> contacts;
    Deviation deviation;
    std::vector<Point> start;            ///< positions before the optimizer
    std::optional<CadReport> cad;        ///< where the boundary was moved onto CAD geometry
    std::optional<FlattenReport> warped; ///< none where cancelled before its end, and where planar
    std::vector<std::string> notes;      ///< what the user should know, one sentence each
    std::string resumed; ///< name of the phase that a checkpoint held; empty: the run began at the start
};

/// Where the surface leaks: octree cells from the inside to the outside, neighbour by neighbour.
struct LeakPath {
    HexMesh cells; ///< empty: no leak
};

class Checkpoint; // pipeline/checkpoint.hpp

/// The flow in memory: refine and trim in turns, fit, buffer, optimize (again from a finer octree while cells
/// fail), settle, measure, name patches. Errors: usage (an option out of range), bad_input (a surface that
/// cannot be meshed; where it leaks *leak gets the path), device, out_of_memory, cancelled before the
/// optimizer began. checkpoint: where the state between stages is kept; one with a state: the run goes on
/// from there, to the same bits; bad_input where that state does not fit.
Result<MeshOutcome> mesh_domain(PreparedDomain prepared, const MeshOptions& options, StageClock& clock,
                                Context& context, LeakPath* leak = nullptr, Checkpoint* checkpoint = nullptr);

/// prepare_domain() and mesh_domain().
Result<MeshOutcome> mesh_surface(const TriangleSoup& surface, const MeshOptions& options, StageClock& clock,
                                 Context& context, LeakPath* leak = nullptr);

} // namespace hexopt
