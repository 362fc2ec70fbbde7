KERNEL_BODY(restrict_product) {
    Slider s = load_slider(slide, gid);
    rvec3 sum = product.at[s.dof] + times(load_sym(limit_block, gid), step.at[s.dof]);
    product.at[s.dof] = restrict_vector(s.freedom, direction.at[gid], sum);
}
