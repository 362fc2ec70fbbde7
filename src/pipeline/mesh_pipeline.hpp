#pragma once

#include "io/mesh_io.hpp"
#include "io/read_cad.hpp"
#include "pipeline/mesh_surface.hpp"

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace hexopt {

/// `hexopt-gpu mesh`: files in, files out. Paths that are empty are not used.
struct MeshJob {
    /// Several: each is a patch named after its file. Or one domain file (.hxd).
    std::vector<std::filesystem::path> surfaces;
    std::filesystem::path output;
    std::filesystem::path report;                     ///< JSON
    std::filesystem::path picture;                    ///< PNG: whole, and cut in half
    std::filesystem::path html;                       ///< web page of the run
    TessellationOptions tessellation;                 ///< of CAD files
    std::vector<std::filesystem::path> feature_files; ///< lines; set options.feature_lines
    std::filesystem::path initial_mesh; ///< hexahedra to start from; sets options.refine.initial.mesh
    MeshOptions options;
    WriteOptions write;
    std::filesystem::path checkpoint; ///< folder for the state between stages; removed at the end
    bool resume = false;              ///< go on with what the folder holds
    bool keep_best = false;           ///< cancelled while optimizing: write the best state reached
};

struct MeshJobResult {
    MeshOutcome outcome;
    std::vector<StageTime> times;
    std::vector<std::filesystem::path> written;
};

/// Reads, meshes, measures, writes. A mesh that has invalid cells is written too (verdict no_valid_mesh); a
/// cancelled run writes only with keep_best, and only once the optimizer has begun. A surface that leaks is
/// an error that names a file beside the output, NAME.leak.vtu, with the cells of a shortest path. A run that
/// goes on with a checkpoint ends with the same bytes as one that was never interrupted. Errors: those of
/// reading (bad_input), mesh_surface(), Checkpoint and writing (output_failed: the earlier file is as it
/// was).
Result<MeshJobResult> run_mesh_job(const MeshJob& job, Context& context);

/// What a job meshes: its domain file as it is, or its surfaces, prepared. Errors: those of reading and of
/// prepare_domain() or build_domain(); usage where the job says otherwise about what a domain file settles.
Result<PreparedDomain> load_domain(const MeshJob& job, StageClock& clock, Context& context);

/// What a job meshes of surfaces that have been read: prepare_domain() with the job's options.
Result<PreparedDomain> prepare_surface(const TriangleSoup& surface, const MeshJob& job, StageClock& clock,
                                       Context& context);

/// `hexopt-gpu domain`: writes what a job would mesh as a domain file (job.output), without weak features.
/// Errors: those of load_domain(); output_failed.
Result<PreparedDomain> run_domain_job(const MeshJob& job, Context& context);

/// Reads one surface, or several as one. Of several files each becomes one patch named after the file without
/// its extension; where a file has patches of its own they become STEM.NAME. tessellation: of CAD files.
Result<TriangleSoup> read_surfaces(const std::vector<std::filesystem::path>& paths,
                                   const TessellationOptions& tessellation, Context& context);

/// Reads the surfaces that bound regions of the job's refinement and have not been read. Errors: those of
/// reading and of RegionSurface::create(), with the file's name.
Status load_region_surfaces(MeshJob& job, StageClock& clock, Context& context);

/// The run as JSON; keys in docs/report.md.
nlohmann::json to_json(const MeshJob& job, const MeshJobResult& result);

} // namespace hexopt
