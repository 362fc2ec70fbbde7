#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

#include <filesystem>

namespace hexopt {

/// Reads a surface: STL (ASCII, binary), OBJ, OFF, PLY (ASCII, binary) or VTP, told apart by content; OBJ,
/// which has no mark, also by its name. Patches are STL's solids, OBJ's groups (objects, materials), or
/// patch_N by the values of VTP's cell array `patch` (or as mesh files have it), in the order of the file.
/// Polygons are cut into triangles around their first vertex. STL has no connectivity: vertices at exactly
/// the same position become one. Degenerate triangles are kept.
///
/// Everything is checked before use, as in read_mesh_file(). Errors: bad_input with file, line or byte and
/// what to do; out_of_memory; cancelled. What is left out is logged as a warning.
Result<TriangleSoup> read_surface(const std::filesystem::path& path, Context& context);

} // namespace hexopt
