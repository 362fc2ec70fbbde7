#pragma once

#include "io/mesh_io.hpp"

#include <string_view>

/// One reader a format. Each gets the whole file in memory; `file` is its name for messages.
namespace hexopt::io_detail {

/// read_mesh_file() of a file that is in memory already.
Result<MeshFile> read_mesh_bytes(const std::string& file, std::string_view bytes, Context& context,
                                 const ReadOptions& options);

bool looks_like_legacy_vtk(std::string_view bytes);
Result<MeshFile> read_legacy_vtk(const std::string& file, std::string_view bytes, Context& context);

bool looks_like_vtu(std::string_view bytes);
Result<MeshFile> read_vtu(const std::string& file, std::string_view bytes, Context& context);

bool looks_like_medit(std::string_view bytes);
bool looks_like_binary_medit(std::string_view bytes);
Result<MeshFile> read_medit(const std::string& file, std::string_view bytes, Context& context);

bool looks_like_gmsh(std::string_view bytes);
Result<MeshFile> read_gmsh(const std::string& file, std::string_view bytes, Context& context);

} // namespace hexopt::io_detail
