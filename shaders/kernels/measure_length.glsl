KERNEL_BODY(measure_length) {
    HexEdges h = load_edges(points, cells, gid, real(1));
    real sum = real(0);
    for (uint i = 0u; i < 12u; ++i) sum += sqrt(h.len2[i]);
    length.at[gid] = sum * real(0.083333333333333333);
}
