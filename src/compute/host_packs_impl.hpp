// Bodies of the host's fast kernels, which work on several vertices at once; included by one translation unit
// an instruction set (host_packs_*.cpp). Every lane gives the bits of the scalar kernel.
#pragma once

#include "compute/host_packs.hpp"

#include "dialect/simd_pack.hpp"

#include <algorithm>

namespace hexopt::compute::HEXOPT_SIMD_NAMESPACE {

namespace f32 {
#define HEXOPT_REAL float
#define HEXOPT_POINT_REAL float
#include "compute/host_packs_newton.inl"
#undef HEXOPT_REAL
#undef HEXOPT_POINT_REAL
} // namespace f32

namespace f64 {
#define HEXOPT_REAL double
#define HEXOPT_POINT_REAL double
#include "compute/host_packs_newton.inl"
#undef HEXOPT_REAL
#undef HEXOPT_POINT_REAL
} // namespace f64

namespace mixed {
#define HEXOPT_REAL float
#define HEXOPT_POINT_REAL double
#include "compute/host_packs_newton.inl"
#undef HEXOPT_REAL
#undef HEXOPT_POINT_REAL
} // namespace mixed

#define HEXOPT_BY_PRECISION(kernel, function)                                                                \
    inline void kernel(Precision precision, HostFunction scalar, const void* args, std::uint32_t begin,      \
                       std::uint32_t end) {                                                                  \
        switch (precision) {                                                                                 \
        case Precision::f32:                                                                                 \
            return f32::function(scalar, args, begin, end);                                                  \
        case Precision::f64:                                                                                 \
            return f64::function(scalar, args, begin, end);                                                  \
        case Precision::mixed:                                                                               \
            return mixed::function(scalar, args, begin, end);                                                \
        }                                                                                                    \
    }
HEXOPT_BY_PRECISION(newton_vertex, newton_vertices)
HEXOPT_BY_PRECISION(newton_regular, newton_regular_vertices)
#undef HEXOPT_BY_PRECISION

} // namespace hexopt::compute::HEXOPT_SIMD_NAMESPACE
