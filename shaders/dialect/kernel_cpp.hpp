#pragma once

#include "dialect/prelude.hpp"

#include <cstdint>

// The kernel layer, C++ side of shaders/dialect/kernel.glsl: a kernel is a struct with its arguments as
// members, so that its body sees them by name as a shader does.
#define KERNEL_BODY(name) inline void name::run(uint gid) const
