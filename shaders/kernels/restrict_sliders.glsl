KERNEL_BODY(restrict_sliders) {
    Slider s = load_slider(slide, gid);
    rvec3 n = direction.at[gid];
    gradient.at[s.dof] = restrict_vector(s.freedom, n, gradient.at[s.dof] + limit_gradient.at[gid]);
    Sym3 m = add_scaled(load_sym(block, s.dof), load_sym(limit_block, gid), real(1));
    store_sym(block, s.dof, restrict_block(s.freedom, n, m));
}
