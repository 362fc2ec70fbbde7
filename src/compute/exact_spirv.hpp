#pragma once

#include "compute/kernel_info.hpp"

#include <vector>

namespace hexopt::compute {

/// The same module with every floating-point operation decorated NoContraction: the driver may neither fuse
/// nor reassociate them, so that a device with correctly rounded operations gives the host's bits.
std::vector<std::uint32_t> forbid_contraction(SpirvBlob module);

} // namespace hexopt::compute
