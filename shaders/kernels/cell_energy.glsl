KERNEL_BODY(cell_energy) {
    Objective o = make_objective(eps, shape_weight, penalty_weight, theta);
    HexEdges h = load_edges(points, cells, gid, inverse_length.at[gid]);
    uint mask = tet_mask.at[gid];
    real sum = real(0);
    real penalty = real(0);
    real least = real(1.0e30);
    for (uint t = 0u; t < 32u; ++t) {
        if ((mask >> t & 1u) == 0u) continue;
        uint a, b, c;
        tet_edges(t, a, b, c);
        real j = tet_jacobian(h.e[a], h.e[b], h.e[c]);
        sum += tet_shape(h.len2[a] + h.len2[b] + h.len2[c], j, o.eps).energy;
        least = min(least, j);
        if (o.penalty_weight > real(0) && is_corner(t)) {
            real below = max(o.theta - scaled_jacobian(j, h.len2[a], h.len2[b], h.len2[c]), real(0));
            penalty += below * below;
        }
    }
    energy.at[gid] = sum * (cell_weight.at[gid] * o.shape_weight) + penalty * o.penalty_weight;
    least_jacobian.at[gid] = least;
}
