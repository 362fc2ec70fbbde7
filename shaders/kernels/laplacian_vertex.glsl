KERNEL_BODY(laplacian_vertex) {
    uint dof = dof_list.at[gid];
    uint v = dof_vertex.at[dof];
    pvec3 here = points.at[v];
    rvec3 sum = rzero();
    real total = real(0);
    for (uint i = neighbour_offset.at[dof]; i < neighbour_offset.at[dof + 1u]; ++i) {
        sum = sum + narrow(points.at[neighbour.at[i]] - here) * neighbour_weight.at[i];
        total += neighbour_weight.at[i];
    }
    if (!(total > real(0))) return;
    rvec3 d = sum * divide(real(1), total);
    if (smart != 0u) {
        Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
        BallQuality before = ball_quality(ball, dof, rzero());
        BallQuality after = ball_quality(ball, dof, d);
        if (after.sj < before.sj || (after.jacobian < before.jacobian && !(after.jacobian > real(0)))) return;
    }
    points.at[v] = here + widen(d);
}
