KERNEL_BODY(gather_cells) {
    rvec3 sum = rzero();
    for (uint i = ball_offset.at[gid]; i < ball_offset.at[gid + 1u]; ++i) {
        uint cell = ball_item.at[2u * i];
        uint row = ball_item.at[2u * i + 1u];
        if (row < 8u) {
            sum = sum + cell_vectors.at[8u * cell + row];
        } else {
            for (uint k = 0u; k < 8u; ++k)
                sum = sum + cell_vectors.at[8u * cell + k] * pattern.at[8u * row + k];
        }
    }
    target.at[gid] = sum * real(scale);
}
