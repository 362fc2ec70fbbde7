// A workgroup of 64 sums a.b over 512 entries: each invocation every 64th of them, then a tree. The host's twin goes
// through the same tree.
#ifdef HEXOPT_GLSL

shared real partial[64];

void run(uint gid) {
    uint lane = gl_LocalInvocationID.x;
    real sum = real(0);
    for (uint k = 0u; k < 8u; ++k) {
        uint i = gid * 512u + k * 64u + lane;
        if (i < entry_count) sum = sum + dot(a.at[i], b.at[i]);
    }
    partial[lane] = sum;
    for (uint half_size = 32u; half_size > 0u; half_size /= 2u) {
        barrier();
        if (lane < half_size) partial[lane] = partial[lane] + partial[lane + half_size];
    }
    if (lane == 0u) target.at[gid] = partial[0];
}

#else

inline void dot_blocks::run(uint gid) const {
    real partial[64];
    for (uint lane = 0u; lane < 64u; ++lane) {
        real sum = real(0);
        for (uint k = 0u; k < 8u; ++k) {
            uint i = gid * 512u + k * 64u + lane;
            if (i < entry_count) sum = sum + dot(a.at[i], b.at[i]);
        }
        partial[lane] = sum;
    }
    for (uint half_size = 32u; half_size > 0u; half_size /= 2u)
        for (uint lane = 0u; lane < half_size; ++lane)
            partial[lane] = partial[lane] + partial[lane + half_size];
    target.at[gid] = partial[0];
}

#endif
