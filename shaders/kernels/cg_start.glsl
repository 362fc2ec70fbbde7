KERNEL_BODY(cg_start) {
    rvec3 r = -gradient.at[gid];
    rvec3 z = solve(load_sym(block, gid), r, real(1.0e-6));
    solution.at[gid] = rzero();
    residual.at[gid] = r;
    preconditioned.at[gid] = z;
    direction.at[gid] = z;
    field.at[dof_vertex.at[gid]] = z;
}
