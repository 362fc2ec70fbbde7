// Energy of one tetrahedron (thesis 4.14 on normalised edges, 3.2, and the default).
FN real tet_energy_of_kind(uint kind, rvec3 a, rvec3 b, rvec3 c, real eps) {
    real size2 = dot(a, a) + dot(b, b) + dot(c, c);
    real j = tet_jacobian(a, b, c);
    // Barriers: without a limit on tetrahedra that are not positive.
    if (kind < 2u && !(j > real(1.0e-9))) return real(1.0e12);
    if (kind == 0u) return divide(size2, j * j * j);
    if (kind == 1u) return tet_shape(size2, j, real(0)).energy;
    if (kind == 2u) {
        rvec3 ga = cross(b, c);
        rvec3 gb = cross(c, a);
        rvec3 gc = cross(a, b);
        real minors2 = dot(ga, ga) + dot(gb, gb) + dot(gc, gc);
        return size2 + minors2 - real(6) * j + (j - real(1)) * (j - real(1));
    }
    return tet_shape(size2, j, eps).energy;
}

FN real ball_energy(Ball ball, uint dof, rvec3 d, uint kind, real eps) {
    real sum = real(0);
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        real inverse = ball.inverse_length.at[cell];
        HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
        EdgeShares s = edge_shares(ball.pattern, ball.item.at[2u * i + 1u], inverse);
        for (uint t = 0u; t < 32u; ++t) {
            uint a, b, c;
            tet_edges(t, a, b, c);
            if (s.c[a] == real(0) && s.c[b] == real(0) && s.c[c] == real(0)) continue;
            sum +=
                ball.cell_weight.at[cell] *
                tet_energy_of_kind(kind, h.e[a] + d * s.c[a], h.e[b] + d * s.c[b], h.e[c] + d * s.c[c], eps);
        }
    }
    return sum;
}

KERNEL_BODY(difference_gradient) {
    Ball ball = make_ball(points, cells, inverse_length, cell_weight, ball_offset, ball_item, pattern);
    real lengths = real(0);
    for (uint i = ball_offset.at[gid]; i < ball_offset.at[gid + 1u]; ++i)
        lengths += divide(real(1), inverse_length.at[ball_item.at[2u * i]]);
    real h = divide(real(step_rel) * lengths, real(ball_offset.at[gid + 1u] - ball_offset.at[gid]));
    real here = ball_energy(ball, gid, rzero(), energy_kind, real(eps));
    real x = ball_energy(ball, gid, rvec3(h, real(0), real(0)), energy_kind, real(eps));
    real y = ball_energy(ball, gid, rvec3(real(0), h, real(0)), energy_kind, real(eps));
    real z = ball_energy(ball, gid, rvec3(real(0), real(0), h), energy_kind, real(eps));
    gradient.at[gid] = rvec3(divide(x - here, h), divide(y - here, h), divide(z - here, h));
}
