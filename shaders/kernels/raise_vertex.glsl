// One Gauss-Newton step on sum (theta - SJ)+^2 over the corners of the ball that depend on the dof.
FN rvec3 raise_direction(Ball ball, uint dof, real theta) {
    rvec3 rhs = rzero();
    Sym3 m = sym_zero();
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        real inverse = ball.inverse_length.at[cell];
        HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
        EdgeShares s = edge_shares(ball.pattern, ball.item.at[2u * i + 1u], inverse);
        for (uint t = 0u; t < 32u; t += 4u) {
            LocalTet tet = local_tet(h, s, t);
            if (tet.l2 == real(0)) continue;
            LocalCorner corner = local_corner(h, s, t, tet);
            real below = theta - corner.sj;
            if (!(below > real(0))) continue;
            rhs = rhs + corner.q * below;
            m = add_outer(m, corner.q, corner.q, real(1));
        }
    }
    return solve(add_identity(m, real(1.0e-3) * trace(m)), rhs, real(1.0e-6));
}

KERNEL_BODY(raise_vertex) {
    uint dof = dof_list.at[gid];
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    BallQuality best = ball_quality(ball, dof, rzero());
    if (best.sj > worst.at[0] + real(margin)) return;
    real shortest = real(1.0e30);
    for (uint i = ball_offset.at[dof]; i < ball_offset.at[dof + 1u]; ++i)
        shortest = min(shortest, real(1) / inverse_length.at[ball_item.at[2u * i]]);
    uint v = dof_vertex.at[dof];
    bool moved = false;
    for (uint round = 0u; round < 3u; ++round) {
        rvec3 d = raise_direction(ball, dof, best.sj + real(gain));
        real longest = real(0.5) * shortest;
        real size = sqrt(dot(d, d));
        if (size > longest) d = d * (longest / size);
        bool better = false;
        for (uint halving = 0u; halving < 3u && !better; ++halving) {
            BallQuality q = ball_quality(ball, dof, d);
            better = q.sj > best.sj && (q.jacobian > real(0) || q.jacobian >= best.jacobian);
            if (better) {
                points.at[v] = points.at[v] + widen(d);
                best = q;
            }
            d = d * real(0.5);
        }
        if (!better) break;
        moved = true;
    }
    if (moved) raised.at[dof] = raised.at[dof] + real(1);
}
