#pragma once

#include "io/scanner.hpp"

namespace hexopt::io_detail {

/// The third line of a legacy VTK file, ASCII or BINARY, after which the scanner reads as it says. On false
/// the scanner holds the error.
bool read_vtk_format(Scanner& scanner, bool& is_binary);

} // namespace hexopt::io_detail
