#include "io/file_bytes.hpp"
#include "io/mesh_io.hpp"
#include "io/readers.hpp"
#include "mesh/recognise_hanging.hpp"

#include <fmt/format.h>
#include <new>

namespace hexopt {

using namespace io_detail;

namespace {

Result<MeshFile> read_by_content(const std::string& file, std::string_view bytes, Context& context) {
    if (looks_like_legacy_vtk(bytes)) return read_legacy_vtk(file, bytes, context);
    if (looks_like_vtu(bytes)) return read_vtu(file, bytes, context);
    if (looks_like_medit(bytes)) return read_medit(file, bytes, context);
    if (looks_like_gmsh(bytes)) return read_gmsh(file, bytes, context);
    if (looks_like_binary_medit(bytes))
        return Error{ErrorCode::bad_input,
                     "read",
                     file,
                     {"binary MEDIT (.meshb) is not supported", "convert it to text (.mesh)"}};
    return Error{
        ErrorCode::bad_input,
        "read",
        file,
        {"no mesh format that is known", "give legacy VTK, VTU, MEDIT .mesh or Gmsh .msh (2.2 or 4.1)"}};
}

/// For formats and programs that do not tell which vertices hang.
Status add_hanging(const std::string& file, HexMesh& mesh, const Context& context) {
    if (!mesh.hanging.empty()) return Done{};
    Result<RecognisedHanging> found = recognise_hanging(mesh, {}, context.parallel());
    if (!found) {
        Error error = found.error();
        error.stage = "read";
        error.where = error.where.empty() ? file : file + ": " + error.where;
        return error;
    }
    if (!found->hanging.empty())
        context.log(LogLevel::info,
                    fmt::format("{}: recognised {} hanging vertices, at most {} from where they belong", file,
                                found->hanging.count(), found->max_deviation));
    mesh.hanging = std::move(found->hanging);
    return Done{};
}

/// Written, but not read: an empty marker, or a folder.
bool is_openfoam_name(const std::filesystem::path& path) {
    const std::filesystem::path plain = path.has_filename() ? path : path.parent_path();
    return plain.extension() == ".foam" || plain.filename() == "polyMesh";
}

} // namespace

Result<MeshFile> io_detail::read_mesh_bytes(const std::string& file, std::string_view bytes, Context& context,
                                            const ReadOptions& options) {
    Result<MeshFile> content = read_by_content(file, bytes, context);
    if (!content || !options.recognise_hanging) return content;
    if (Status status = add_hanging(file, content->mesh, context); !status) return status.error();
    return content;
}

Result<MeshFile> read_mesh_file(const std::filesystem::path& path, Context& context,
                                const ReadOptions& options) {
    if (is_openfoam_name(path))
        return Error{ErrorCode::bad_input,
                     "read",
                     path.string(),
                     {"OpenFOAM's meshes are written, but not read", "name the mesh as .vtu, .vtk or .mesh"}};
    try {
        const Result<FileBytes> bytes = read_file(path, context);
        if (!bytes) return bytes.error();
        return read_mesh_bytes(path.string(), bytes->view(), context, options);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "read", path.string(), "no memory for this mesh");
    }
}

Result<HexMesh> read_mesh(const std::filesystem::path& path, Context& context, const ReadOptions& options) {
    Result<MeshFile> file = read_mesh_file(path, context, options);
    if (!file) return file.error();
    return std::move(file->mesh);
}

} // namespace hexopt
