// C++ types of the kernel layer. Include inside a namespace with HEXOPT_REAL and HEXOPT_POINT_REAL set to
// float or double, after dialect/kernel_cpp.hpp. No include guard: one inclusion a precision.
#include "dialect/cpp_types.hpp"

using uint = std::uint32_t;
using preal = HEXOPT_POINT_REAL;
using pvec3 = ::hexopt::dialect::Vec3<preal>;

/// For preal where it is not real.
template <class T>
inline T max(T a, T b) {
    return a < b ? b : a;
}

struct IndexArray {
    uint* at;
};
struct RealArray {
    real* at;
};
struct Vec3Array {
    rvec3* at;
};
struct PointArray {
    pvec3* at;
};

inline rvec3 narrow(pvec3 a) { return rvec3(real(a.x), real(a.y), real(a.z)); }
inline pvec3 widen(rvec3 a) { return pvec3(preal(a.x), preal(a.y), preal(a.z)); }
