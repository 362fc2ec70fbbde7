KERNEL_BODY(cell_quality) {
    HexEdges h = load_edges(points, cells, gid, inverse_length.at[gid]);
    uint mask = tet_mask.at[gid];
    real sj = real(1);
    bool bad_corner = false;
    bool bad_tet = false;
    for (uint t = 0u; t < 32u; ++t) {
        if ((mask >> t & 1u) == 0u) continue;
        uint a, b, c;
        tet_edges(t, a, b, c);
        real j = tet_jacobian(h.e[a], h.e[b], h.e[c]);
        if (!(j > real(0))) bad_tet = true;
        if (!is_corner(t)) continue;
        if (!(j > real(0))) bad_corner = true;
        sj = min(sj, scaled_jacobian(j, h.len2[a], h.len2[b], h.len2[c]));
    }
    scaled_jacobian_of.at[gid] = sj;
    bad8.at[gid] = bad_corner ? real(1) : real(0);
    bad32.at[gid] = bad_tet ? real(1) : real(0);
}
