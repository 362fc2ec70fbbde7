KERNEL_BODY(take_step) {
    uint v = dof_vertex.at[gid];
    target.at[v] = points.at[v] + widen(step.at[gid] * real(length));
}
