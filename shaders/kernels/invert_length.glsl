KERNEL_BODY(invert_length) {
    real least = divide(real(floor_rel) * length_sum.at[0], real(count));
    inverse_length.at[gid] = divide(real(1), max(max(length.at[gid], least), real(1.0e-30)));
}
