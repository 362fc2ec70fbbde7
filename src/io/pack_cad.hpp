#pragma once

#include "io/project_on_cad.hpp"
#include "io/read_cad.hpp"

#include <string>
#include <string_view>

namespace hexopt::io_detail {

/// What work on a CAD file ends with, as it passes from one process to the other.
struct CadOutcome {
    CadSurface surface;
    std::vector<CadPoint> points; ///< of project_on_cad(), one a query; `match` negative where there is none
    std::optional<Error> error;   ///< instead of the surface
    std::vector<std::string> warnings;
};

std::string pack(const CadOutcome& outcome);
/// False where bytes are no packed outcome.
bool unpack(std::string_view bytes, CadOutcome& outcome);

} // namespace hexopt::io_detail
