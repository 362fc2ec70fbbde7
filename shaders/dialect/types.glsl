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

// The built-in dot() and cross() may be fused whatever the module says of its other instructions.
float exact_dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
vec3 exact_cross(vec3 a, vec3 b) {
    return vec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
}

// Vulkan lets a float division or root be off by a few units in the last place. Where REFINED, the remainder of
// the device's own answer, exact in a fused operation, mends it to the host's bits (P. Markstein, Computation of
// elementary functions on the IBM RISC System/6000 processor, 1990); powers of two keep it off the limits of the
// exponent. Software devices round correctly, but do not fuse.
layout(constant_id = 0) const bool REFINED = false;

bool refinable(float x) { return abs(x) >= 1.1754944e-38 && abs(x) <= 3.4028235e38; }

// 1 and -1 where x needs multiplying by 2^64 and 2^-64.
int exponent_shift(float x) { return abs(x) < 8.6736174e-19 ? 1 : abs(x) > 1.1529215e18 ? -1 : 0; }

// 2^(32 n), n = -2..2
float power_of_two(int n) { return uintBitsToFloat(uint(127 + 32 * n) << 23); }

float divide(float a, float b) {
    if (!REFINED || !refinable(a) || !refinable(b)) return a / b;
    int shift_a = exponent_shift(a);
    int shift_b = exponent_shift(b);
    float x = a * power_of_two(2 * shift_a);
    float y = b * power_of_two(2 * shift_b);
    float inverse = 1.0 / y;
    inverse = fma(fma(-y, inverse, 1.0), inverse, inverse);
    float quotient = x * inverse;
    quotient = fma(fma(-y, quotient, x), inverse, quotient);
    float back = power_of_two(shift_b - shift_a);
    return quotient * back * back;
}

float exact_sqrt(float x) {
    if (!REFINED || !refinable(x) || x < 0.0) return sqrt(x);
    int shift = exponent_shift(x);
    float y = x * power_of_two(2 * shift);
    float root = sqrt(y);
    return fma(fma(-root, root, y), 0.5 / root, root) * power_of_two(-shift);
}

#if defined(HEXOPT_F64) || defined(HEXOPT_WIDE_POINTS)
double exact_dot(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
dvec3 exact_cross(dvec3 a, dvec3 b) {
    return dvec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
}
double divide(double a, double b) { return a / b; }
double exact_sqrt(double x) { return sqrt(x); }
#endif

#define dot exact_dot
#define cross exact_cross
#define sqrt exact_sqrt

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
