#pragma once

#include "compute/kernel_info.hpp"

namespace hexopt::compute {

HostFunction host_function_f32(KernelId id);
HostFunction host_function_f64(KernelId id);
HostFunction host_function_mixed(KernelId id);
HostFunction host_function(KernelId id, Precision precision);
SpirvBlob spirv_blob(KernelId id, Precision precision);

} // namespace hexopt::compute
