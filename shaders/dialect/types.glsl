// Types and helper functions of the shared mathematics, GLSL side. The same files under shaders/math are compiled
// as C++ with shaders/dialect/cpp_types.hpp (scalars) and simd_types.hpp (packs) in place of this file.
// HEXOPT_F64 selects double. Rules: docs/dialect.md.
#ifdef HEXOPT_F64
#define real double
#define rvec3 dvec3
#else
#define real float
#define rvec3 vec3
#endif
#define rbool bool
#define FN
#define OUT(T) out T
#define INOUT(T) inout T

real sel(bool condition, real yes, real no) { return condition ? yes : no; }

// First guess of x^(-1/3) for normal x > 0, relative error below 4 %.
#ifdef HEXOPT_F64
double rcbrt_seed(double x) {
    const uint high = unpackDouble2x32(x).y;
    return packDouble2x32(uvec2(0u, 0x553EF0FFu - high / 3u));
}
#else
float rcbrt_seed(float x) { return uintBitsToFloat(0x54A2FA8Cu - floatBitsToUint(x) / 3u); }
#endif
