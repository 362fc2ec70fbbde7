// Instead of read_cad.cpp in a build without OpenCASCADE.
#include "io/cad_format.hpp"

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

bool cad_is_supported() { return false; }

} // namespace hexopt
