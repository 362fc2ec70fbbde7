KERNEL_BODY(limit_sliders) {
    Slider s = load_slider(slide, gid);
    pvec3 at = points.at[s.vertex];
    pvec3 foot = at;
    if (s.freedom == 0u) {
        Foot f = slider_foot(make_surface(box, link, element), s, at);
        foot = f.point;
        slide.at[6u * gid + 5u] = f.element;
    }
    Limit l = slider_limit(limits, gid, s.freedom, at, foot, real(weight));
    energy.at[gid] = l.energy;
    gradient.at[gid] = l.gradient;
    store_sym(block, gid, l.hessian);
}
