KERNEL_BODY(laplacian_blocks) {
    real sum = real(0);
    for (uint i = ball_offset.at[gid]; i < ball_offset.at[gid + 1u]; ++i) {
        EdgeShares s = edge_shares(pattern, ball_item.at[2u * i + 1u], real(1));
        real squares = real(0);
        for (uint k = 0u; k < 12u; ++k) squares += s.c[k] * s.c[k];
        sum += squares * edge_weight.at[ball_item.at[2u * i]];
    }
    store_sym(block, gid, add_identity(sym_zero(), sum));
}
