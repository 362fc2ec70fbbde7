#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/triangle_soup.hpp"

#include <filesystem>

namespace hexopt {

struct WriteSurfaceOptions {
    /// STL only: 50 bytes a triangle, coordinates rounded to single precision, and no patches (a warning
    /// says so). Text keeps all digits, and the patches as solids.
    bool binary = false;
};

/// Writes a surface as STL or OBJ (patches as groups), by the name's extension. Patches in their order, each
/// triangle in its place within its patch; names keep everything but control characters. The file appears
/// whole or not at all (AtomicFile); same input, same bytes. Errors: usage (another extension, binary OBJ),
/// output_failed (an id out of range, a coordinate that is not finite, a failing disk), cancelled.
Status write_surface(const std::filesystem::path& path, const TriangleSoup& surface,
                     const WriteSurfaceOptions& options, Context& context);

/// Whether write_surface() writes files of this name.
bool is_surface_name(const std::filesystem::path& path);

} // namespace hexopt
