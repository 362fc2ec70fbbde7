KERNEL_BODY(constrain_field) {
    rvec3 sum = rzero();
    for (uint k = hanging_offset.at[gid]; k < hanging_offset.at[gid + 1u]; ++k)
        sum = sum + field.at[hanging_master.at[k]] * hanging_weight.at[k];
    field.at[hanging_vertex.at[gid]] = sum;
}
