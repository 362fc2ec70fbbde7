#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/feature_lines.hpp"

#include <filesystem>

namespace hexopt {

/// Reads feature edges: OpenFOAM's .eMesh (featureEdgeMesh and extendedFeatureEdgeMesh, text), OBJ with `l`
/// statements, legacy VTK and VTP poly data with lines, told apart by content; and .csv (x,y,z a row, an
/// empty row between polylines). Segments of length 0 are dropped. Errors: bad_input with file, line or byte,
/// and what to do; out_of_memory; cancelled.
Result<FeatureLines> read_feature_lines(const std::filesystem::path& path, Context& context);

} // namespace hexopt
