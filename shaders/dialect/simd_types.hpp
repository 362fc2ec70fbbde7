// SIMD side of shaders/dialect/types.glsl: `real` is a pack of HEXOPT_SIMD_BYTES bytes of HEXOPT_REAL, so that the
// shared mathematics works on several cells or vertices at once. Include inside a namespace, after
// dialect/simd_pack.hpp. Every lane computes what the scalar code computes, bit for bit.
using lane_real = HEXOPT_REAL;
using real = ::hexopt::dialect::HEXOPT_SIMD_NAMESPACE::Pack<lane_real>;
using rbool = real::Mask;
using rvec3 = ::hexopt::dialect::Vec3<real>;
using ::hexopt::dialect::cross;
using ::hexopt::dialect::divide;
using ::hexopt::dialect::dot;
inline constexpr int kLanes = real::kLanes;
