KERNEL_BODY(cg_direction) {
    real rz = scalars.at[0];
    real beta = rz > real(0) ? divide(scalars.at[2], rz) : real(0);
    rvec3 p = preconditioned.at[gid] + direction.at[gid] * beta;
    direction.at[gid] = p;
    field.at[dof_vertex.at[gid]] = p;
}
