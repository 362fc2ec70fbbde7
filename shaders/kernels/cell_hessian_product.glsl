// Per tetrahedron with edges x_k, g_k = dJ/dx_k and edge changes p_k, P = sum g.p, X = sum x.p:
// (H p)_k = 2 h p_k + alpha (x_k P + g_k X) + beta g_k P
KERNEL_BODY(cell_hessian_product) {
    Objective o = make_objective(eps, shape_weight, penalty_weight, theta);
    real inverse = inverse_length.at[gid];
    HexEdges h = load_edges(points, cells, gid, inverse);
    HexEdges p = load_field(field, cells, gid, inverse);
    HexEdges sum;
    for (uint k = 0u; k < 12u; ++k) sum.e[k] = rzero();
    real factor = cell_weight.at[gid] * o.shape_weight;
    uint mask = tet_mask.at[gid];
    for (uint t = 0u; t < 32u; ++t) {
        if ((mask >> t & 1u) == 0u) continue;
        uint a, b, c;
        tet_edges(t, a, b, c);
        rvec3 ga = cross(h.e[b], h.e[c]);
        rvec3 gb = cross(h.e[c], h.e[a]);
        rvec3 gc = cross(h.e[a], h.e[b]);
        real j = dot(h.e[a], ga);
        TetShape shape = tet_shape(h.len2[a] + h.len2[b] + h.len2[c], j, o.eps);
        real along_g = dot(ga, p.e[a]) + dot(gb, p.e[b]) + dot(gc, p.e[c]);
        real along_x = dot(h.e[a], p.e[a]) + dot(h.e[b], p.e[b]) + dot(h.e[c], p.e[c]);
        real twice_h = real(2) * shape.scale * factor;
        real alpha = tet_hessian_alpha(shape) * factor;
        real x_part = alpha * along_g;
        real g_part = alpha * along_x + tet_hessian_beta(shape) * factor * along_g;
        sum.e[a] = sum.e[a] + p.e[a] * twice_h + h.e[a] * x_part + ga * g_part;
        sum.e[b] = sum.e[b] + p.e[b] * twice_h + h.e[b] * x_part + gb * g_part;
        sum.e[c] = sum.e[c] + p.e[c] * twice_h + h.e[c] * x_part + gc * g_part;
        if (o.penalty_weight > real(0) && is_corner(t)) {
            real la = max(h.len2[a], real(1.0e-30));
            real lb = max(h.len2[b], real(1.0e-30));
            real lc = max(h.len2[c], real(1.0e-30));
            real scale = divide(real(1), sqrt(la) * sqrt(lb) * sqrt(lc));
            real sj = j * scale;
            rvec3 qa = ga * scale - h.e[a] * divide(sj, la);
            rvec3 qb = gb * scale - h.e[b] * divide(sj, lb);
            rvec3 qc = gc * scale - h.e[c] * divide(sj, lc);
            real along_q = dot(qa, p.e[a]) + dot(qb, p.e[b]) + dot(qc, p.e[c]);
            real w = sj < o.theta ? real(2) * o.penalty_weight * along_q : real(0);
            sum.e[a] = sum.e[a] + qa * w;
            sum.e[b] = sum.e[b] + qb * w;
            sum.e[c] = sum.e[c] + qc * w;
        }
    }
    store_vertex_sums(product, gid, sum, inverse);
}
