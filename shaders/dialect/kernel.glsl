// The kernel layer, GLSL side (docs/dialect.md): what the generated wrapper of every kernel includes before
// its argument block. HEXOPT_F64 selects double, HEXOPT_WIDE_POINTS positions in double with float
// arithmetic.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require

#include "dialect/types.glsl"

#if defined(HEXOPT_WIDE_POINTS) || defined(HEXOPT_F64)
#define preal double
#define pvec3 dvec3
#define HEXOPT_POINT_ALIGN 8
#else
#define preal float
#define pvec3 vec3
#define HEXOPT_POINT_ALIGN 4
#endif
#ifdef HEXOPT_F64
#define HEXOPT_REAL_ALIGN 8
#else
#define HEXOPT_REAL_ALIGN 4
#endif

// clang-format off
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer IndexArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = HEXOPT_REAL_ALIGN) buffer RealArray { real at[]; };
layout(buffer_reference, scalar, buffer_reference_align = HEXOPT_REAL_ALIGN) buffer Vec3Array { rvec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = HEXOPT_POINT_ALIGN) buffer PointArray { pvec3 at[]; };
    // clang-format on

#define HEXOPT_GLSL
#define KERNEL_BODY(name) void run(uint gid)

rvec3 narrow(pvec3 a) { return rvec3(a); }
pvec3 widen(rvec3 a) { return pvec3(a); }

#include "math/scaled_jacobian.glsl"
#include "math/tet_energy.glsl"

#include "math/sym3.glsl"

#include "math/corner_ball.glsl"

#include "dialect/kernel_hex.glsl"

#include "dialect/kernel_surface.glsl"
