// Energy of a tetrahedron: I1 + I2 - 6 J + (J - 1)^2 with I1 = sum |edge|^2, I2 = sum |edge x edge|^2. The
// step is the negative gradient over the mean diagonal of the Gauss-Newton Hessian.
KERNEL_BODY(hyperelastic_step) {
    uint v = dof_vertex.at[gid];
    rvec3 slope = rzero();
    real curvature = real(0);
    for (uint i = ball_offset.at[gid]; i < ball_offset.at[gid + 1u]; ++i) {
        uint cell = ball_item.at[2u * i];
        real inverse = inverse_length.at[cell];
        real factor = cell_weight.at[cell];
        HexEdges h = load_edges(points, cells, cell, inverse);
        EdgeShares s = edge_shares(pattern, ball_item.at[2u * i + 1u], inverse);
        for (uint t = 0u; t < 32u; ++t) {
            LocalTet tet = local_tet(h, s, t);
            if (tet.l2 == real(0)) continue;
            uint a, b, c;
            tet_edges(t, a, b, c);
            // Minor e_k x e_l changes by d x u with u = c_k e_l - c_l e_k.
            rvec3 ua = h.e[c] * s.c[b] - h.e[b] * s.c[c];
            rvec3 ub = h.e[a] * s.c[c] - h.e[c] * s.c[a];
            rvec3 uc = h.e[b] * s.c[a] - h.e[a] * s.c[b];
            rvec3 minors = cross(ua, cross(h.e[b], h.e[c])) + cross(ub, cross(h.e[c], h.e[a])) +
                           cross(uc, cross(h.e[a], h.e[b]));
            slope = slope + (tet.x * real(2) + minors * real(2) +
                             tet.g * (real(2) * (tet.jacobian - real(1)) - real(6))) *
                                factor;
            real u2 = dot(ua, ua) + dot(ub, ub) + dot(uc, uc);
            curvature += factor * (real(2) * tet.l2 + real(1.3333333333333333) * u2 +
                                   real(0.66666666666666667) * dot(tet.g, tet.g));
        }
    }
    rvec3 d = slope * divide(-real(relaxation), max(curvature, real(1.0e-30)));
    target.at[v] = points.at[v] + widen(d);
}
