// C++ scalar side of shaders/dialect/types.glsl. Include inside a namespace with HEXOPT_REAL set to float or double,
// after dialect/prelude.hpp. No include guard: one inclusion a precision.
using real = HEXOPT_REAL;
using rvec3 = ::hexopt::dialect::Vec3<real>;
using rbool = bool;
using ::hexopt::dialect::cross;
using ::hexopt::dialect::divide;
using ::hexopt::dialect::dot;

inline real sqrt(real x) { return std::sqrt(x); }
inline real abs(real x) { return std::abs(x); }
inline real min(real a, real b) { return b < a ? b : a; }
inline real max(real a, real b) { return a < b ? b : a; }
inline real sel(rbool condition, real yes, real no) { return condition ? yes : no; }
inline real rcbrt_seed(real x) { return ::hexopt::dialect::rcbrt_seed(x); }
