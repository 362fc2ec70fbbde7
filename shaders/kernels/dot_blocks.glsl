KERNEL_BODY(dot_blocks) {
    uint begin = gid * 64u;
    uint end = entry_count - begin < 64u ? entry_count : begin + 64u;
    real sum = real(0);
    for (uint i = begin; i < end; ++i) sum += dot(a.at[i], b.at[i]);
    target.at[gid] = sum;
}
