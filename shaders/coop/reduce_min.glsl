#define COMBINE(a, b) min(a, b)
#define NEUTRAL real(3.0e38)
#ifndef HEXOPT_GLSL
inline void reduce_min::run(uint gid) const
#endif
#include "coop/reduce.glsl"
#undef COMBINE
#undef NEUTRAL
