// What several kernels share: the edges of a cell, how its tetrahedra depend on one vertex's displacement,
// and the sums over a ball. Terms: docs/compute.md. The tetrahedra are those of hex::kTetEdge
// (src/mesh/hex_reference.hpp).

// Edges of a cell (hex::kEdgeVertex), divided by its target length, and their squared lengths.
struct HexEdges {
    rvec3 e[12];
    real len2[12];
};

FN HexEdges edges_of(rvec3 p1, rvec3 p2, rvec3 p3, rvec3 p4, rvec3 p5, rvec3 p6, rvec3 p7) {
    HexEdges h;
    h.e[0] = p1;
    h.e[1] = p2 - p3;
    h.e[2] = p5 - p4;
    h.e[3] = p6 - p7;
    h.e[4] = p3;
    h.e[5] = p2 - p1;
    h.e[6] = p7 - p4;
    h.e[7] = p6 - p5;
    h.e[8] = p4;
    h.e[9] = p5 - p1;
    h.e[10] = p7 - p3;
    h.e[11] = p6 - p2;
    for (uint i = 0u; i < 12u; ++i) h.len2[i] = dot(h.e[i], h.e[i]);
    return h;
}

// Differences are taken in `preal` and rounded afterwards.
FN HexEdges load_edges(PointArray points, IndexArray cells, uint cell, real inverse) {
    uint k = 8u * cell;
    pvec3 o = points.at[cells.at[k]];
    return edges_of(
        narrow(points.at[cells.at[k + 1u]] - o) * inverse, narrow(points.at[cells.at[k + 2u]] - o) * inverse,
        narrow(points.at[cells.at[k + 3u]] - o) * inverse, narrow(points.at[cells.at[k + 4u]] - o) * inverse,
        narrow(points.at[cells.at[k + 5u]] - o) * inverse, narrow(points.at[cells.at[k + 6u]] - o) * inverse,
        narrow(points.at[cells.at[k + 7u]] - o) * inverse);
}

// The same of a field of vectors on the vertices.
FN HexEdges load_field(Vec3Array field, IndexArray cells, uint cell, real inverse) {
    uint k = 8u * cell;
    rvec3 o = field.at[cells.at[k]];
    return edges_of((field.at[cells.at[k + 1u]] - o) * inverse, (field.at[cells.at[k + 2u]] - o) * inverse,
                    (field.at[cells.at[k + 3u]] - o) * inverse, (field.at[cells.at[k + 4u]] - o) * inverse,
                    (field.at[cells.at[k + 5u]] - o) * inverse, (field.at[cells.at[k + 6u]] - o) * inverse,
                    (field.at[cells.at[k + 7u]] - o) * inverse);
}

// Sum over the edges at each vertex of a cell: slope[e] pulls at the edge's second vertex, pushes at its
// first.
FN void store_vertex_sums(Vec3Array target, uint cell, HexEdges s, real f) {
    uint k = 8u * cell;
    target.at[k] = (s.e[0] + s.e[4] + s.e[8]) * (-f);
    target.at[k + 1u] = (s.e[0] - s.e[5] - s.e[9]) * f;
    target.at[k + 2u] = (s.e[1] + s.e[5] - s.e[11]) * f;
    target.at[k + 3u] = (s.e[4] - s.e[1] - s.e[10]) * f;
    target.at[k + 4u] = (s.e[8] - s.e[2] - s.e[6]) * f;
    target.at[k + 5u] = (s.e[2] + s.e[9] - s.e[7]) * f;
    target.at[k + 6u] = (s.e[3] + s.e[7] + s.e[11]) * f;
    target.at[k + 7u] = (s.e[6] + s.e[10] - s.e[3]) * f;
}

// How the edges of a cell change with one dof: by coefficient times its displacement (in target units).
struct EdgeShares {
    real c[12];
};

FN EdgeShares edge_shares(RealArray pattern, uint row, real inverse) {
    uint k = 8u * row;
    real w0 = pattern.at[k];
    real w1 = pattern.at[k + 1u];
    real w2 = pattern.at[k + 2u];
    real w3 = pattern.at[k + 3u];
    real w4 = pattern.at[k + 4u];
    real w5 = pattern.at[k + 5u];
    real w6 = pattern.at[k + 6u];
    real w7 = pattern.at[k + 7u];
    EdgeShares s;
    s.c[0] = (w1 - w0) * inverse;
    s.c[1] = (w2 - w3) * inverse;
    s.c[2] = (w5 - w4) * inverse;
    s.c[3] = (w6 - w7) * inverse;
    s.c[4] = (w3 - w0) * inverse;
    s.c[5] = (w2 - w1) * inverse;
    s.c[6] = (w7 - w4) * inverse;
    s.c[7] = (w6 - w5) * inverse;
    s.c[8] = (w4 - w0) * inverse;
    s.c[9] = (w5 - w1) * inverse;
    s.c[10] = (w7 - w3) * inverse;
    s.c[11] = (w6 - w2) * inverse;
    return s;
}

// Edge numbers of tetrahedron t: along xi (0-3), eta (4-7) and zeta (8-11).
FN void tet_edges(uint t, OUT(uint) a, OUT(uint) b, OUT(uint) c) {
    uint x = t >> 2u & 1u;
    uint y = t >> 3u & 1u;
    uint z = t >> 4u;
    uint kind = t & 3u;
    a = y + 2u * z;
    b = 4u + x + 2u * (kind == 3u ? 1u - z : z);
    c = 8u + (kind == 2u ? 1u - x : x) + 2u * (kind == 1u ? 1u - y : y);
}

FN bool is_corner(uint t) { return (t & 3u) == 0u; }

FN LocalTet local_tet(HexEdges h, EdgeShares s, uint t) {
    uint a, b, c;
    tet_edges(t, a, b, c);
    LocalTet tet;
    rvec3 ga = cross(h.e[b], h.e[c]);
    tet.jacobian = dot(h.e[a], ga);
    tet.size2 = h.len2[a] + h.len2[b] + h.len2[c];
    tet.g = ga * s.c[a] + cross(h.e[c], h.e[a]) * s.c[b] + cross(h.e[a], h.e[b]) * s.c[c];
    tet.x = h.e[a] * s.c[a] + h.e[b] * s.c[b] + h.e[c] * s.c[c];
    tet.l2 = s.c[a] * s.c[a] + s.c[b] * s.c[b] + s.c[c] * s.c[c];
    return tet;
}

// Scaled Jacobian of a corner and its gradient q by the dof's displacement.
struct LocalCorner {
    real sj;
    rvec3 q;
};

FN LocalCorner local_corner(HexEdges h, EdgeShares s, uint t, LocalTet tet) {
    uint a, b, c;
    tet_edges(t, a, b, c);
    real la = max(h.len2[a], real(1.0e-30));
    real lb = max(h.len2[b], real(1.0e-30));
    real lc = max(h.len2[c], real(1.0e-30));
    real inverse = divide(real(1), sqrt(la) * sqrt(lb) * sqrt(lc));
    LocalCorner corner;
    corner.sj = tet.jacobian * inverse;
    rvec3 along = h.e[a] * divide(s.c[a], la) + h.e[b] * divide(s.c[b], lb) + h.e[c] * divide(s.c[c], lc);
    corner.q = tet.g * inverse - along * corner.sj;
    return corner;
}

// What is minimised: shape_weight * weight of the cell * sum over its tetrahedra of the regularised shape
// energy
// + penalty_weight * sum over its corners of (theta - SJ)+^2. No penalty where its weight is 0.
struct Objective {
    real eps;
    real shape_weight;
    real penalty_weight;
    real theta;
};

FN Objective make_objective(float eps, float shape_weight, float penalty_weight, float theta) {
    Objective o;
    o.eps = real(eps);
    o.shape_weight = real(shape_weight);
    o.penalty_weight = real(penalty_weight);
    o.theta = real(theta);
    return o;
}

// The mesh as the kernels on dofs see it. Entry i of a dof's ball is cell ball_item[2 i] and row ball_item[2
// i + 1] of `pattern`: how much of the dof's displacement each of the cell's 8 vertices makes (1 at the
// vertex itself, the constraint's weight where a vertex hangs on it).
struct Ball {
    PointArray points;
    IndexArray cells;
    RealArray inverse_length;
    RealArray cell_weight;
    IndexArray offset;
    IndexArray item;
    RealArray pattern;
};

FN Ball make_ball(PointArray points, IndexArray cells, RealArray inverse_length, RealArray cell_weight,
                  IndexArray offset, IndexArray item, RealArray pattern) {
    Ball b;
    b.points = points;
    b.cells = cells;
    b.inverse_length = inverse_length;
    b.cell_weight = cell_weight;
    b.offset = offset;
    b.item = item;
    b.pattern = pattern;
    return b;
}

// Vertex of a cell that is corner (x, y, z) once the cell is turned so that `corner` is (0, 0, 0); x and y
// change places where a reflection would be needed.
FN uint turned_vertex(uint corner, uint x, uint y, uint z) {
    uint cx = (corner ^ (corner >> 1u)) & 1u;
    uint cy = corner >> 1u & 1u;
    uint cz = corner >> 2u;
    bool odd = (cx ^ cy ^ cz) == 1u;
    uint ax = (odd ? y : x) ^ cx;
    uint ay = (odd ? x : y) ^ cy;
    uint az = z ^ cz;
    return (ax ^ ay) + 2u * ay + 4u * az;
}

FN rvec3 turned_point(Ball ball, uint cell, uint corner, pvec3 o, real inverse, uint x, uint y, uint z) {
    return narrow(ball.points.at[ball.cells.at[8u * cell + turned_vertex(corner, x, y, z)]] - o) * inverse;
}

FN CornerEdges load_corner(Ball ball, uint cell, uint corner, real inverse) {
    pvec3 o = ball.points.at[ball.cells.at[8u * cell + corner]];
    return corner_edges(turned_point(ball, cell, corner, o, inverse, 1u, 0u, 0u),
                        turned_point(ball, cell, corner, o, inverse, 0u, 1u, 0u),
                        turned_point(ball, cell, corner, o, inverse, 1u, 1u, 0u),
                        turned_point(ball, cell, corner, o, inverse, 0u, 0u, 1u),
                        turned_point(ball, cell, corner, o, inverse, 1u, 0u, 1u),
                        turned_point(ball, cell, corner, o, inverse, 0u, 1u, 1u),
                        turned_point(ball, cell, corner, o, inverse, 1u, 1u, 1u));
}

// Adds a cell whose corners move by several weights, or whose corners are penalised.
FN LocalModel add_general_cell(LocalModel m, Ball ball, uint cell, uint row, Objective o) {
    real inverse = ball.inverse_length.at[cell];
    real factor = ball.cell_weight.at[cell] * o.shape_weight;
    HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
    EdgeShares s = edge_shares(ball.pattern, row, inverse);
    for (uint t = 0u; t < 32u; ++t) {
        LocalTet tet = local_tet(h, s, t);
        if (tet.l2 == real(0)) continue;
        m = add_tet(m, tet, o.eps, factor);
        if (o.penalty_weight > real(0) && is_corner(t)) {
            LocalCorner corner = local_corner(h, s, t, tet);
            real below = max(o.theta - corner.sj, real(0));
            m.energy += o.penalty_weight * below * below;
            m.gradient = m.gradient - corner.q * (real(2) * o.penalty_weight * below);
            if (below > real(0))
                m.hessian = add_outer(m.hessian, corner.q, corner.q, real(2) * o.penalty_weight);
        }
    }
    return m;
}

FN LocalModel ball_model(Ball ball, uint dof, Objective o) {
    LocalModel m = model_zero();
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        uint row = ball.item.at[2u * i + 1u];
        if (row < 8u && !(o.penalty_weight > real(0))) {
            real inverse = ball.inverse_length.at[cell];
            real factor = ball.cell_weight.at[cell] * o.shape_weight;
            LocalModel part = corner_model(load_corner(ball, cell, row, inverse), o.eps);
            m.energy += part.energy * factor;
            m.gradient = m.gradient + part.gradient * (factor * inverse);
            m.hessian = add_scaled(m.hessian, part.hessian, factor * inverse * inverse);
        } else {
            m = add_general_cell(m, ball, cell, row, o);
        }
    }
    return m;
}

// Energies of a ball at the lengths of a line search along d.
FN LineEnergies ball_line(Ball ball, uint dof, rvec3 d, real omega, real eps) {
    LineEnergies l = line_zero();
    real d2 = dot(d, d);
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        uint row = ball.item.at[2u * i + 1u];
        real inverse = ball.inverse_length.at[cell];
        real factor = ball.cell_weight.at[cell];
        if (row < 8u) {
            LineEnergies part = corner_line(load_corner(ball, cell, row, inverse), d * inverse, omega, eps);
            l = add_lines(l, part, factor);
        } else {
            HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
            EdgeShares s = edge_shares(ball.pattern, row, inverse);
            for (uint t = 0u; t < 32u; ++t) {
                LocalTet tet = local_tet(h, s, t);
                if (tet.l2 == real(0)) continue;
                l = add_line(l, tet, d, d2, omega, eps, factor);
            }
        }
    }
    return l;
}

// Regularised energy of a ball with the dof moved by d.
FN real ball_energy(Ball ball, uint dof, rvec3 d, real eps) {
    real sum = real(0);
    real d2 = dot(d, d);
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        uint row = ball.item.at[2u * i + 1u];
        real inverse = ball.inverse_length.at[cell];
        real part = real(0);
        if (row < 8u) {
            part = corner_energy(load_corner(ball, cell, row, inverse), d * inverse, eps);
        } else {
            HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
            EdgeShares s = edge_shares(ball.pattern, row, inverse);
            for (uint t = 0u; t < 32u; ++t) {
                LocalTet tet = local_tet(h, s, t);
                if (tet.l2 == real(0)) continue;
                part += tet_energy_at(tet, d, d2, eps);
            }
        }
        sum += ball.cell_weight.at[cell] * part;
    }
    return sum;
}

// Smallest scaled Jacobian of the corners and smallest J of the tetrahedra that depend on a dof, with the dof
// moved by d.
struct BallQuality {
    real sj;
    real jacobian;
};

FN BallQuality ball_quality(Ball ball, uint dof, rvec3 d) {
    BallQuality q;
    q.sj = real(1);
    q.jacobian = real(1.0e30);
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        real inverse = ball.inverse_length.at[cell];
        HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
        EdgeShares s = edge_shares(ball.pattern, ball.item.at[2u * i + 1u], inverse);
        real moved[12];
        for (uint k = 0u; k < 12u; ++k) {
            moved[k] = s.c[k];
            h.e[k] = h.e[k] + d * s.c[k];
            h.len2[k] = dot(h.e[k], h.e[k]);
        }
        for (uint t = 0u; t < 32u; ++t) {
            uint a, b, c;
            tet_edges(t, a, b, c);
            if (moved[a] == real(0) && moved[b] == real(0) && moved[c] == real(0)) continue;
            real j = tet_jacobian(h.e[a], h.e[b], h.e[c]);
            q.jacobian = min(q.jacobian, j);
            if (is_corner(t)) q.sj = min(q.sj, scaled_jacobian(j, h.len2[a], h.len2[b], h.len2[c]));
        }
    }
    return q;
}

FN void store_sym(RealArray target, uint row, Sym3 m) {
    uint k = 6u * row;
    target.at[k] = m.xx;
    target.at[k + 1u] = m.xy;
    target.at[k + 2u] = m.xz;
    target.at[k + 3u] = m.yy;
    target.at[k + 4u] = m.yz;
    target.at[k + 5u] = m.zz;
}

FN Sym3 load_sym(RealArray source, uint row) {
    uint k = 6u * row;
    Sym3 m;
    m.xx = source.at[k];
    m.xy = source.at[k + 1u];
    m.xz = source.at[k + 2u];
    m.yy = source.at[k + 3u];
    m.yz = source.at[k + 4u];
    m.zz = source.at[k + 5u];
    return m;
}

// One Gauss-Newton step on sum (theta - SJ)+^2 over the corners of the ball that depend on the dof.
struct RaiseModel {
    rvec3 rhs;
    Sym3 hessian;
};

FN RaiseModel raise_model(Ball ball, uint dof, real theta) {
    RaiseModel r;
    r.rhs = rzero();
    r.hessian = sym_zero();
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i) {
        uint cell = ball.item.at[2u * i];
        real inverse = ball.inverse_length.at[cell];
        HexEdges h = load_edges(ball.points, ball.cells, cell, inverse);
        EdgeShares s = edge_shares(ball.pattern, ball.item.at[2u * i + 1u], inverse);
        for (uint t = 0u; t < 32u; t += 4u) {
            LocalTet tet = local_tet(h, s, t);
            if (tet.l2 == real(0)) continue;
            LocalCorner corner = local_corner(h, s, t, tet);
            real below = theta - corner.sj;
            if (!(below > real(0))) continue;
            r.rhs = r.rhs + corner.q * below;
            r.hessian = add_outer(r.hessian, corner.q, corner.q, real(1));
        }
    }
    return r;
}

FN rvec3 raise_direction(RaiseModel r) {
    return solve(add_identity(r.hessian, real(1.0e-3) * trace(r.hessian)), r.rhs, real(1.0e-6));
}

FN rvec3 clamp_step(rvec3 d, real longest) {
    real size = sqrt(dot(d, d));
    if (size > longest) return d * divide(longest, size);
    return d;
}

// Least target length of a ball's cells.
FN real shortest_length(Ball ball, uint dof) {
    real shortest = real(1.0e30);
    for (uint i = ball.offset.at[dof]; i < ball.offset.at[dof + 1u]; ++i)
        shortest = min(shortest, divide(real(1), ball.inverse_length.at[ball.item.at[2u * i]]));
    return shortest;
}
