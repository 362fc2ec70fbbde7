// Bodies of the hexahedron kernels, included by one translation unit an instruction set (hex_kernels_*.cpp).
#pragma once

#include "stages/optimize/hex_kernels.hpp"

#include "dialect/simd_pack.hpp"
#include "mesh/hex_reference.hpp"

namespace hexopt::HEXOPT_SIMD_NAMESPACE {

namespace f64 {
#define HEXOPT_REAL double
#include "dialect/simd_types.hpp"

#include "math/scaled_jacobian.glsl"
#include "math/tet_energy.glsl"
#undef HEXOPT_REAL
#include "stages/optimize/hex_kernels_lanes.hpp"
} // namespace f64

namespace f32 {
#define HEXOPT_REAL float
#include "dialect/simd_types.hpp"

#include "math/scaled_jacobian.glsl"
#include "math/tet_energy.glsl"
#undef HEXOPT_REAL
#include "stages/optimize/hex_kernels_lanes.hpp"
} // namespace f32

void value(const HexGroup& group, HexValue& out) {
    for (int first = 0; first < kGroup; first += f64::kLanes) f64::lanes_value(group, first, out);
}

void gradient(const HexGroup& group, HexGradient& out) {
    for (int first = 0; first < kGroup; first += f64::kLanes) f64::lanes_gradient(group, first, out);
}

void hessian(const HexGroup& group, HexHessian& out) {
    for (int first = 0; first < kGroup; first += f32::kLanes) f32::lanes_hessian(group, first, out);
}

void measure(const HexGroup& group, HexMeasure& out) {
    for (int first = 0; first < kGroup; first += f64::kLanes) f64::lanes_measure(group, first, out);
}

} // namespace hexopt::HEXOPT_SIMD_NAMESPACE
