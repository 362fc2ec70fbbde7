KERNEL_BODY(dof_gradient) {
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    LocalModel m = ball_model(ball, gid, make_objective(eps, shape_weight, penalty_weight, theta));
    gradient.at[gid] = m.gradient;
    store_sym(block, gid, m.hessian);
}
