#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

#include <array>
#include <filesystem>
#include <optional>

namespace hexopt {

/// How closely triangles follow the exact surfaces of a CAD file.
struct TessellationOptions {
    double deflection_rel = 1e-4; ///< distance of triangles from the surface, of the diagonal; 1e-7..0.1
    double angle_deg = 10;        ///< turn of the normal along one edge; 1..90
    bool unnamed_borders = false; ///< faces that the file does not name are patches of their own groups
};

/// A CAD file as triangles.
struct CadSurface {
    TriangleSoup soup; ///< mm (STEP, IGES) or the file's own unit (BREP)
    /// Per patch of the soup: red, green, blue, 0..1 (linear), where the file colours it.
    std::vector<std::optional<std::array<double, 3>>> patch_colour;
    std::size_t face_count = 0;   ///< topological faces of the file
    std::size_t failed_faces = 0; ///< of them without triangles (a warning is logged)
};

/// Whether this build reads CAD files (HEXOPT_WITH_OCCT).
bool cad_is_supported();

/// Reads STEP, IGES or BREP (text) through OpenCASCADE. STEP and IGES are converted to mm from whatever unit
/// they state. Faces become patches with their names; faces of one name share a patch; those without a name,
/// or with one that all faces bear, are face_1, face_2 ... in the order of the file. Triangles of faces that
/// share an edge share its vertices, so that closed shells of a STEP or BREP file are closed. Triangles are
/// counter-clockwise seen from outside a solid. IGES surfaces are sewn within 1e-5 of the diagonal. The same
/// file gives the same triangles.
///
/// OpenCASCADE runs in a process of its own (fork), so that a damaged file that crashes it, or makes it use
/// more than 4 GiB or 4 KiB a byte of the file, is an error here; cancelling ends it at once.
///
/// Errors: usage (options out of range); bad_input (not CAD, cut short, counts beyond the file, no faces, one
/// that crashes OpenCASCADE, a build without it); out_of_memory; cancelled.
Result<CadSurface> read_cad(const std::filesystem::path& path, const TessellationOptions& options,
                            Context& context);

} // namespace hexopt
