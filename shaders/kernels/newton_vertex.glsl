KERNEL_BODY(newton_vertex) {
    uint dof = dof_list.at[gid];
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    LocalModel m = ball_model(ball, dof, make_objective(eps, 1.0f, 0.0f, 0.0f));
    rvec3 d = newton_step(m);
    real slope = dot(m.gradient, d);
    if (!(slope < real(0))) return;
    // One more pass over the ball serves every length, since a tetrahedron is affine or quadratic along d.
    LineEnergies l = ball_line(ball, dof, d, real(omega), real(eps));
    uint v = dof_vertex.at[dof];
    points.at[v] = points.at[v] + widen(d * search_length(l, m.energy, slope, real(omega)));
}
