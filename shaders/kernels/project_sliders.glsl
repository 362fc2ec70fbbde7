KERNEL_BODY(project_sliders) {
    Slider s = load_slider(slide, gid);
    if (s.freedom == 0u) return;
    Surface surface = make_surface(box, link, element);
    Foot f = slider_foot(surface, s, points.at[s.vertex]);
    points.at[s.vertex] = f.point;
    direction.at[gid] = foot_direction(surface, f);
    slide.at[6u * gid + 5u] = f.element;
}
