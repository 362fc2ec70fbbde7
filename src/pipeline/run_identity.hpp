#pragma once

#include "pipeline/mesh_pipeline.hpp"

#include <string>
#include <utility>
#include <vector>

namespace hexopt {

/// All that the result of a run hangs on, as names and values: program, seed, files with a digest of their
/// bytes, and every key but those of the output. Not the number of threads.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;

/// Errors: those of reading the job's files.
Result<RunIdentity> identify_run(const MeshJob& job, Context& context);

/// What differs first, e.g. "refine.size was 0.1 and is 0.2"; empty where nothing does.
std::string describe_difference(const RunIdentity& before, const RunIdentity& now);

} // namespace hexopt
