KERNEL_BODY(raise_vertex) {
    uint dof = dof_list.at[gid];
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    BallQuality best = ball_quality(ball, dof, rzero());
    if (best.sj > worst.at[0] + real(margin)) return;
    real longest = real(0.5) * shortest_length(ball, dof);
    uint v = dof_vertex.at[dof];
    bool moved = false;
    for (uint round = 0u; round < 3u; ++round) {
        rvec3 d = clamp_step(raise_direction(raise_model(ball, dof, best.sj + real(gain))), longest);
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
