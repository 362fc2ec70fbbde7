#include "pipeline/check_outputs.hpp"

#include "io/write_openfoam.hpp"
#include "render/png.hpp"

#include <system_error>
#include <unistd.h>

namespace hexopt {

namespace {

namespace fs = std::filesystem;

Error refusal(ErrorCode code, const fs::path& path, std::string reason, std::string advice) {
    return Error{code, "write", path.string(), {std::move(reason), std::move(advice)}};
}

/// Files are written beside their place first, so that it is the folder that must let itself be written to.
Status check_folder(const fs::path& path) {
    std::error_code error;
    const fs::path target = fs::is_symlink(path, error) ? fs::weakly_canonical(path, error) : path;
    const fs::path folder = target.has_parent_path() ? target.parent_path() : ".";
    if (!fs::is_directory(folder, error))
        return refusal(ErrorCode::output_failed, path, "no such directory: " + folder.string(),
                       "create it first");
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        return refusal(ErrorCode::output_failed, path,
                       "cannot write to the directory " + folder.string() + ": " +
                           std::generic_category().message(errno),
                       "give it permission, or write somewhere else");
    return Done{};
}

Status check_file(const fs::path& path) {
    if (Status ok = check_folder(path); !ok) return ok;
    std::error_code error;
    if (fs::is_directory(path, error))
        return refusal(ErrorCode::output_failed, path, "is a directory", "name a file");
    return Done{};
}

Status check_mesh(const fs::path& path, const WriteOptions& writing) {
    const auto format = choose_format(path, writing);
    if (!format) return format.error();
    if (openfoam_folder(path).empty()) return check_file(path);
    const fs::path named = path.has_filename() ? path : path.parent_path();
    if (Status ok = check_folder(named); !ok) return ok;
    return check_openfoam_folder(path);
}

} // namespace

bool is_same_file(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::weakly_canonical(fs::absolute(a, error), error) ==
           fs::weakly_canonical(fs::absolute(b, error), error);
}

Status check_not_read(const fs::path& output, const std::vector<fs::path>& inputs) {
    for (const fs::path& input : inputs)
        if (!input.empty() && is_same_file(output, input))
            return refusal(ErrorCode::usage, output, "is read by this run, and would be lost",
                           "write to another file");
    return Done{};
}

Status check_outputs(const RunOutputs& outputs, const WriteOptions& writing,
                     const std::vector<fs::path>& inputs) {
    if (Status ok = check_mesh(outputs.mesh, writing); !ok) return ok;
    if (!outputs.picture.empty())
        if (Status ok = check_png_name(outputs.picture); !ok) return ok;
    std::vector<fs::path> taken = {outputs.mesh};
    for (const fs::path& path : {outputs.picture, outputs.report, outputs.page}) {
        if (path.empty()) continue;
        if (Status ok = check_file(path); !ok) return ok;
        for (const fs::path& other : taken)
            if (is_same_file(path, other))
                return refusal(ErrorCode::usage, path, "is named for two outputs",
                               "give each a file of its own");
        taken.push_back(path);
    }
    for (const fs::path& path : taken)
        if (Status ok = check_not_read(path, inputs); !ok) return ok;
    return Done{};
}

} // namespace hexopt
