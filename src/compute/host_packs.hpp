#pragma once

#include "compute/kernel_info.hpp"

namespace hexopt::compute {

/// Runs invocations begin..end-1 of a kernel on vector units; `scalar`: the plain kernel, for what does not
/// fit packs.
using PackFunction = void (*)(Precision precision, HostFunction scalar, const void* args, std::uint32_t begin,
                              std::uint32_t end);

/// The kernels that there are packs for, of one instruction set.
struct NewtonPacks {
    PackFunction vertex, regular;
};

/// The widest version that this processor runs, with the scalar kernel's bits; null where there is none.
PackFunction pack_function(const KernelInfo& kernel);

} // namespace hexopt::compute
