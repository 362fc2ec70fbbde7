KERNEL_BODY(constrain_points) {
    pvec3 sum = pvec3(preal(0), preal(0), preal(0));
    for (uint k = hanging_offset.at[gid]; k < hanging_offset.at[gid + 1u]; ++k)
        sum = sum + points.at[hanging_master.at[k]] * preal(hanging_weight.at[k]);
    points.at[hanging_vertex.at[gid]] = sum;
}
