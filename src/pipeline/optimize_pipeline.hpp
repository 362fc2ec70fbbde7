#pragma once

#include "pipeline/improve_mesh.hpp"

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace hexopt {

/// `hexopt-gpu optimize`: files in, files out. Paths that are empty are not used.
struct OptimizeJob {
    std::filesystem::path input, output;
    std::filesystem::path surface; ///< triangles that the boundary slides on; sets improve.surface
    std::vector<std::filesystem::path> feature_files; ///< lines; add to improve.feature_lines
    std::filesystem::path report;                     ///< JSON
    std::filesystem::path picture;                    ///< PNG of before and after
    std::filesystem::path html;                       ///< web page of the run
    ImproveOptions improve;
    std::optional<bool> flatten; ///< sets improve.flatten; none: where the output is OpenFOAM's
    bool keep_best = false;      ///< cancelled: write the best state reached
};

/// Whether the job's mesh gets its faces flattened.
bool flattens(const OptimizeJob& job);

struct OptimizeJobResult {
    ImproveOutcome outcome;
    std::vector<StageTime> times;
    std::vector<std::filesystem::path> written;
};

/// Reads, improves, measures, writes. A mesh that still has invalid cells is written too (verdict
/// no_valid_mesh); a cancelled run writes only with keep_best. Errors: those of reading (bad_input),
/// improve_mesh() and writing (output_failed: the earlier file is as it was).
Result<OptimizeJobResult> run_optimize_job(const OptimizeJob& job, Context& context);

/// The run as JSON; keys in docs/report.md.
nlohmann::json to_json(const OptimizeJob& job, const OptimizeJobResult& result);

} // namespace hexopt
