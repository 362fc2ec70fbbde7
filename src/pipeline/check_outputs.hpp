#pragma once

#include "core/result.hpp"

#include <filesystem>
#include <vector>

namespace hexopt {

/// Checks where results will go before hours are spent on them: the mesh's format, and that every path lies
/// in a folder that is there and is none itself (but for OpenFOAM). Empty paths are not looked at. Errors:
/// usage (unknown extension), output_failed.
Status check_outputs(const std::filesystem::path& mesh, const std::vector<std::filesystem::path>& others);

} // namespace hexopt
