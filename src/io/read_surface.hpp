#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "io/read_cad.hpp"
#include "mesh/triangle_soup.hpp"

#include <filesystem>

namespace hexopt {

/// Reads a surface: STL (ASCII, binary), OBJ, OFF, PLY (ASCII, binary) or VTP, told apart by content; OBJ,
/// which has no mark, also by its name; STEP, IGES and BREP as read_cad(), which tells more of them. Patches
/// are STL's solids, OBJ's groups (objects, materials), or patch_N by the values of VTP's cell array `patch`
/// (or as mesh files have it), in the order of the file. Polygons are cut into triangles around their first
/// vertex. STL has no connectivity: vertices at exactly the same position become one. Degenerate triangles
/// are kept.
///
/// Everything is checked before use, as in read_mesh_file(). Errors: bad_input with file, line or byte and
/// what to do; out_of_memory; cancelled. What is left out is logged as a warning.
Result<TriangleSoup> read_surface(const std::filesystem::path& path, Context& context);

/// As above; tessellation: how closely triangles follow the surfaces of a CAD file. Errors also: usage
/// (options out of range).
Result<TriangleSoup> read_surface(const std::filesystem::path& path, const TessellationOptions& tessellation,
                                  Context& context);

} // namespace hexopt
