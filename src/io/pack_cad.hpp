#pragma once

#include "io/read_cad.hpp"

#include <string>
#include <string_view>

namespace hexopt::io_detail {

/// What reading a CAD file ends with, as it passes from one process to the other.
struct CadOutcome {
    CadSurface surface;
    std::optional<Error> error; ///< instead of the surface
    std::vector<std::string> warnings;
};

std::string pack(const CadOutcome& outcome);
/// False where bytes are no packed outcome.
bool unpack(std::string_view bytes, CadOutcome& outcome);

} // namespace hexopt::io_detail
