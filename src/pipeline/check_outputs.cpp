#include "pipeline/check_outputs.hpp"

#include "io/mesh_io.hpp"
#include "io/write_openfoam.hpp"

namespace hexopt {

Status check_outputs(const std::filesystem::path& mesh, const std::vector<std::filesystem::path>& others) {
    if (auto format = format_of_name(mesh); !format) return format.error();
    std::vector<std::filesystem::path> paths = {mesh};
    paths.insert(paths.end(), others.begin(), others.end());
    for (const std::filesystem::path& path : paths) {
        if (path.empty()) continue;
        const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
        std::error_code error;
        if (!std::filesystem::is_directory(folder, error))
            return make_error(ErrorCode::output_failed, "write", path.string(),
                              "no such directory: " + folder.string());
        const bool takes_folder = path == mesh && !openfoam_folder(path).empty();
        if (std::filesystem::is_directory(path, error) && !takes_folder)
            return make_error(ErrorCode::output_failed, "write", path.string(), "is a directory");
    }
    return Done{};
}

} // namespace hexopt
