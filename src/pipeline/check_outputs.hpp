#pragma once

#include "core/result.hpp"
#include "io/mesh_io.hpp"

#include <filesystem>
#include <vector>

namespace hexopt {

/// Where a run's results are to go. Empty paths are not looked at.
struct RunOutputs {
    std::filesystem::path mesh;
    std::filesystem::path picture; ///< PNG
    std::filesystem::path report, page;
};

/// Checks where results will go before hours are spent on them: the mesh's format and the picture's, that
/// each path lies in a folder that is there and may be written to, is none itself (but for OpenFOAM, whose
/// folder must hold nothing else), that no two are one file and none is one of `inputs`, which would be lost.
/// Errors: usage (a format, one file for two things), output_failed.
Status check_outputs(const RunOutputs& outputs, const WriteOptions& writing,
                     const std::vector<std::filesystem::path>& inputs);

/// Whether both paths stand for one file, now or once it is written.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Error usage where a file that is to be written is also read: what it held would be lost.
Status check_not_read(const std::filesystem::path& output, const std::vector<std::filesystem::path>& inputs);

} // namespace hexopt
