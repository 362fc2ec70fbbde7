// raise_vertex for a vertex on its surface or near it; its range is a fence here.
KERNEL_BODY(raise_slider) {
    uint entry = slide_list.at[gid];
    Slider s = load_slider(slide, entry);
    if (s.freedom == 3u) return;
    // No energy is asked for, so that the cells' weights do not matter.
    Ball ball = make_ball(points, cells, inverse_length, inverse_length, ball_offset, ball_item, pattern);
    BallQuality best = ball_quality(ball, s.dof, rzero());
    if (best.sj > worst.at[0] + real(margin)) return;
    Surface surface = make_surface(box, link, element);
    real longest = real(0.5) * shortest_length(ball, s.dof);
    pvec3 range = limits.at[2u * entry + 1u];
    bool moved = false;
    for (uint round = 0u; round < 3u; ++round) {
        pvec3 here = points.at[s.vertex];
        Foot foot = slider_foot(surface, s, here);
        s.hint = foot.element;
        rvec3 n = foot_direction(surface, foot);
        RaiseModel m = raise_model(ball, s.dof, best.sj + real(gain));
        m.rhs = restrict_vector(s.freedom, n, m.rhs);
        m.hessian = restrict_block(s.freedom, n, m.hessian);
        rvec3 d = clamp_step(restrict_vector(s.freedom, n, raise_direction(m)), longest);
        bool better = false;
        for (uint halving = 0u; halving < 3u && !better; ++halving) {
            pvec3 wanted = here + widen(d);
            Foot f = slider_foot(surface, s, wanted);
            if (s.freedom > 0u) wanted = f.point;
            rvec3 off = narrow(wanted - f.point);
            rvec3 way = narrow(f.point - limits.at[2u * entry]);
            bool inside = dot(way, way) <= real(range.x) * real(range.x) &&
                          dot(off, off) <= real(range.y) * real(range.y);
            BallQuality q = ball_quality(ball, s.dof, narrow(wanted - here));
            better = inside && q.sj > best.sj && (q.jacobian > real(0) || q.jacobian >= best.jacobian);
            if (better) {
                points.at[s.vertex] = wanted;
                slide.at[6u * entry + 5u] = f.element;
                best = q;
            }
            d = d * real(0.5);
        }
        if (!better) break;
        moved = true;
    }
    if (moved) raised.at[s.dof] = raised.at[s.dof] + real(1);
}
