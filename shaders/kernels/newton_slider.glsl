// A place on the surface, or near it, and what the ball's energy is with the vertex there.
struct Place {
    pvec3 at;
    real energy;
    uint hint;
};

FN Place try_place(Ball ball, Surface surface, PointArray limits, uint entry, Slider s, pvec3 wanted, real eps,
                   real weight) {
    Foot f = slider_foot(surface, s, wanted);
    Place p;
    p.at = wanted;
    if (s.freedom > 0u) p.at = f.point;
    p.hint = f.element;
    p.energy = ball_energy(ball, s.dof, narrow(p.at - ball.points.at[s.vertex]), eps) +
               slider_limit(limits, entry, s.freedom, p.at, f.point, weight).energy;
    return p;
}

KERNEL_BODY(newton_slider) {
    uint entry = slide_list.at[gid];
    Slider s = load_slider(slide, entry);
    if (s.freedom == 3u) return;
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    Surface surface = make_surface(box, link, element);
    pvec3 here = points.at[s.vertex];
    Foot foot = slider_foot(surface, s, here);
    s.hint = foot.element;
    rvec3 n = foot_direction(surface, foot);
    LocalModel m = ball_model(ball, s.dof, make_objective(eps, 1.0f, 0.0f, 0.0f));
    Limit limit = slider_limit(limits, entry, s.freedom, here, foot.point, real(weight));
    m.energy += limit.energy;
    m.gradient = restrict_vector(s.freedom, n, m.gradient + limit.gradient);
    m.hessian = restrict_block(s.freedom, n, add_scaled(m.hessian, limit.hessian, real(1)));
    rvec3 d = restrict_vector(s.freedom, n, newton_step(m));
    real slope = dot(m.gradient, d);
    if (!(slope < real(0))) return;
    real size = real(1);
    for (uint trial = 0u; trial < 5u; ++trial) {
        Place p = try_place(ball, surface, limits, entry, s, here + widen(d * size), real(eps), real(weight));
        if (accepts(p.energy, m.energy, slope, size)) {
            if (trial == 0u) {
                Place over = try_place(ball, surface, limits, entry, s, here + widen(d * real(omega)), real(eps),
                                       real(weight));
                if (over.energy < m.energy) p = over;
            }
            points.at[s.vertex] = p.at;
            slide.at[6u * entry + 5u] = p.hint;
            return;
        }
        size = size * real(0.4);
    }
}
