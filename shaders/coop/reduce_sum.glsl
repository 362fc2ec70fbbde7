#define COMBINE(a, b) ((a) + (b))
#define NEUTRAL real(0)
#ifndef HEXOPT_GLSL
inline void reduce_sum::run(uint gid) const
#endif
#include "coop/reduce.glsl"
#undef COMBINE
#undef NEUTRAL
