#pragma once

#include <iostream>

/// Ends a test that cannot run here, e.g. for want of the shared meshes or of a Vulkan device. ctest counts
/// it as skipped and shows the reason.
#define HEXOPT_SKIP(reason)                                                                                  \
    do {                                                                                                     \
        std::cout << "SKIPPED: " << (reason) << std::endl;                                                   \
        return;                                                                                              \
    } while (false)
