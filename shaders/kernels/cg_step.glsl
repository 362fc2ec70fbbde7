// rz: r.z; scalars: 0 r.z at the start, 1 p.Ap. Once converged nothing moves any more.
KERNEL_BODY(cg_step) {
    real curvature = scalars.at[1];
    bool moving = rz.at[0] > real(tolerance) * scalars.at[0] && curvature > real(0);
    real alpha = moving ? divide(rz.at[0], curvature) : real(0);
    rvec3 r = residual.at[gid] - product.at[gid] * alpha;
    solution.at[gid] = solution.at[gid] + direction.at[gid] * alpha;
    residual.at[gid] = r;
    preconditioned.at[gid] = solve(load_sym(block, gid), r, real(1.0e-6));
}
