// Length number k of the line search: over-relaxed, full, then shorter by 0.4 each.
FN real search_length(uint k, real omega) {
    if (k == 0u) return omega;
    real a = real(1);
    for (uint i = 1u; i < k; ++i) a = a * real(0.4);
    return a;
}

KERNEL_BODY(newton_vertex) {
    uint dof = dof_list.at[gid];
    Objective o = make_objective(eps, 1.0f, 0.0f, 0.0f);
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    LocalModel m = ball_model(ball, dof, o);
    rvec3 d = solve(m.hessian, -m.gradient, real(1.0e-6));
    real slope = dot(m.gradient, d);
    if (!(slope < real(0))) return;

    // One more pass over the ball serves every length, since each tetrahedron is affine or quadratic along d.
    real energy[6];
    for (uint k = 0u; k < 6u; ++k) energy[k] = real(0);
    real d2 = dot(d, d);
    for (uint i = ball_offset.at[dof]; i < ball_offset.at[dof + 1u]; ++i) {
        uint cell = ball_item.at[2u * i];
        real inverse = inverse_length.at[cell];
        real factor = cell_weight.at[cell];
        HexEdges h = load_edges(points, cells, cell, inverse);
        EdgeShares s = edge_shares(pattern, ball_item.at[2u * i + 1u], inverse);
        for (uint t = 0u; t < 32u; ++t) {
            LocalTet tet = local_tet(h, s, t);
            if (tet.l2 == real(0)) continue;
            real j1 = dot(tet.g, d);
            real s1 = real(2) * dot(tet.x, d);
            real s2 = tet.l2 * d2;
            for (uint k = 0u; k < 6u; ++k) {
                real a = search_length(k, real(omega));
                energy[k] +=
                    factor * tet_shape(tet.size2 + a * (s1 + a * s2), tet.jacobian + a * j1, o.eps).energy;
            }
        }
    }
    real length = real(0);
    for (uint k = 5u; k >= 1u; --k) {
        real a = search_length(k, real(omega));
        if (energy[k] <= m.energy + real(1.0e-4) * a * slope) length = a;
    }
    if (length == real(1) && energy[0] < m.energy) length = real(omega);
    uint v = dof_vertex.at[dof];
    points.at[v] = points.at[v] + widen(d * length);
}
