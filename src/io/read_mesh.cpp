#include "io/file_bytes.hpp"
#include "io/mesh_io.hpp"
#include "io/readers.hpp"

#include <new>

namespace hexopt {

namespace {

using namespace io_detail;

Result<MeshFile> read_by_content(const std::string& file, std::string_view bytes, Context& context) {
    if (looks_like_legacy_vtk(bytes)) return read_legacy_vtk(file, bytes, context);
    if (looks_like_vtu(bytes)) return read_vtu(file, bytes, context);
    if (looks_like_medit(bytes)) return read_medit(file, bytes, context);
    return Error{
        ErrorCode::bad_input,
        "read",
        file,
        {"no mesh format that is known", "give legacy VTK, VTU, MEDIT .mesh or Gmsh .msh (2.2 or 4.1)"}};
}

} // namespace

Result<MeshFile> read_mesh_file(const std::filesystem::path& path, Context& context) {
    try {
        const Result<FileBytes> bytes = read_file(path, context);
        if (!bytes) return bytes.error();
        return read_by_content(path.string(), bytes->view(), context);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "read", path.string(), "no memory for this mesh");
    }
}

Result<HexMesh> read_mesh(const std::filesystem::path& path, Context& context) {
    Result<MeshFile> file = read_mesh_file(path, context);
    if (!file) return file.error();
    return std::move(file->mesh);
}

} // namespace hexopt
