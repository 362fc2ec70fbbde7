// A workgroup of 64 combines 2048 entries: each invocation every 64th of them, then a tree. The host's twin
// goes through the same tree. The including file defines COMBINE and NEUTRAL.
#ifdef HEXOPT_GLSL

shared real partial[64];

void run(uint gid) {
    uint lane = gl_LocalInvocationID.x;
    real sum = NEUTRAL;
    for (uint k = 0u; k < 32u; ++k) {
        uint i = gid * 2048u + k * 64u + lane;
        if (i < entry_count) sum = COMBINE(sum, source.at[i]);
    }
    partial[lane] = sum;
    for (uint half_size = 32u; half_size > 0u; half_size /= 2u) {
        barrier();
        if (lane < half_size) partial[lane] = COMBINE(partial[lane], partial[lane + half_size]);
    }
    if (lane == 0u) target.at[gid] = partial[0];
}

#else

{
    real partial[64];
    for (uint lane = 0u; lane < 64u; ++lane) {
        real sum = NEUTRAL;
        for (uint k = 0u; k < 32u; ++k) {
            uint i = gid * 2048u + k * 64u + lane;
            if (i < entry_count) sum = COMBINE(sum, source.at[i]);
        }
        partial[lane] = sum;
    }
    for (uint half_size = 32u; half_size > 0u; half_size /= 2u)
        for (uint lane = 0u; lane < half_size; ++lane)
            partial[lane] = COMBINE(partial[lane], partial[lane + half_size]);
    target.at[gid] = partial[0];
}

#endif
