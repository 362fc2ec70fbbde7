KERNEL_BODY(cg_direction) {
    real beta = rz.at[0] > real(0) ? divide(new_rz.at[0], rz.at[0]) : real(0);
    rvec3 p = preconditioned.at[gid] + direction.at[gid] * beta;
    direction.at[gid] = p;
    field.at[dof_vertex.at[gid]] = p;
}
