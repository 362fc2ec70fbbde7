// scalars: 0 r.z, 1 p.Ap, 2 the new r.z, 3 r.z at the start. Once converged nothing moves any more.
KERNEL_BODY(cg_step) {
    real rz = scalars.at[0];
    real curvature = scalars.at[1];
    bool moving = rz > real(tolerance) * scalars.at[3] && curvature > real(0);
    real alpha = moving ? divide(rz, curvature) : real(0);
    rvec3 r = residual.at[gid] - product.at[gid] * alpha;
    solution.at[gid] = solution.at[gid] + direction.at[gid] * alpha;
    residual.at[gid] = r;
    preconditioned.at[gid] = solve(load_sym(block, gid), r, real(1.0e-6));
}
