// Instead of read_cad.cpp in a build without OpenCASCADE.
#include "io/cad_format.hpp"
#include "io/project_on_cad.hpp"

namespace hexopt {

Result<CadSurface> io_detail::read_cad_bytes(const std::string& file, std::string_view bytes,
                                             const TessellationOptions&, const Context&) {
    if (const Status status = check_cad(recognise_cad(file, bytes), file, bytes); !status)
        return status.error();
    return Error{ErrorCode::bad_input,
                 "read",
                 file,
                 {"a CAD file, and this build has no OpenCASCADE to read it",
                  "build with libocct-data-exchange-dev installed, or export the model as STL"}};
}

Result<std::vector<std::optional<CadPoint>>> project_on_cad(const std::filesystem::path& path, std::uint64_t,
                                                            const TessellationOptions&, double,
                                                            std::span<const CadQuery>, Context&) {
    return make_error(ErrorCode::bad_input, "cad projection", path.string(), "this build has no OpenCASCADE");
}

bool cad_is_supported() { return false; }

} // namespace hexopt
