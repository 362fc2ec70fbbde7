// Seidel's incremental linear program in four variables (the displacement and the depth): rows a.x
// <= b, maximise the last variable. A violated row holds with equality at the optimum of the rows so far,
// which removes one variable; the four levels are written as four nested loops, since shaders have no
// recursion.

struct Row {
    real a[4];
    real b;
};

// Removes variable p by an equality a.x = b.
struct Elimination {
    uint p;
    Row row;
};

// Entry `place` of the working set, the first row_count rows of the list, the last added first.
FN Row load_row(RealArray rows, uint base, uint place, uint row_count) {
    uint k = 4u * (base + row_count - 1u - place);
    Row r;
    r.a[0] = rows.at[k];
    r.a[1] = rows.at[k + 1u];
    r.a[2] = rows.at[k + 2u];
    r.b = rows.at[k + 3u];
    // Constraints have depth coefficient 1; the box's rows, marked by |a| = 2, have none.
    real size = abs(r.a[0]) + abs(r.a[1]) + abs(r.a[2]);
    real norm2 = r.a[0] * r.a[0] + r.a[1] * r.a[1] + r.a[2] * r.a[2];
    bool is_box = size == real(2) && norm2 == real(4);
    r.a[3] = is_box ? real(0) : real(1);
    return r;
}

FN Elimination eliminate(Row r, uint n) {
    Elimination e;
    e.p = 0u;
    for (uint q = 1u; q < n; ++q)
        if (abs(r.a[q]) > abs(r.a[e.p])) e.p = q;
    e.row = r;
    return e;
}

// From n variables to n - 1.
FN Row project(Row r, Elimination e, uint n) {
    real f = divide(r.a[e.p], e.row.a[e.p]);
    Row s;
    for (uint q = 0u; q < 4u; ++q) s.a[q] = real(0);
    uint to = 0u;
    for (uint q = 0u; q < n; ++q) {
        if (q == e.p) continue;
        s.a[to] = r.a[q] - f * e.row.a[q];
        to += 1u;
    }
    s.b = r.b - f * e.row.b;
    return s;
}

// From n - 1 variables back to n.
FN Row lift(Row x, Elimination e, uint n) {
    Row y;
    y.b = real(0);
    for (uint q = 0u; q < 4u; ++q) y.a[q] = real(0);
    real rest = e.row.b;
    uint from = 0u;
    for (uint q = 0u; q < n; ++q) {
        if (q == e.p) continue;
        y.a[q] = x.a[from];
        rest -= e.row.a[q] * x.a[from];
        from += 1u;
    }
    y.a[e.p] = divide(rest, e.row.a[e.p]);
    return y;
}

FN bool is_violated(Row r, Row x, uint n) {
    real value = -r.b;
    real size = abs(r.b);
    for (uint q = 0u; q < n; ++q) {
        value += r.a[q] * x.a[q];
        size += abs(r.a[q] * x.a[q]);
    }
    return value > real(1.0e-12) * size + real(1.0e-14);
}

FN bool is_flat(Row r, uint n) {
    real largest = real(0);
    for (uint q = 0u; q < n; ++q) largest = max(largest, abs(r.a[q]));
    return largest < real(1.0e-9);
}

// Best corner of the box |x| <= 1000 for objective c.
FN Row far_corner(Row c, uint n) {
    Row x;
    x.b = real(0);
    for (uint q = 0u; q < 4u; ++q) x.a[q] = q < n ? (c.a[q] > real(0) ? real(1000) : real(-1000)) : real(0);
    return x;
}

FN Row solve_line(RealArray rows, uint base, uint count, uint row_count, Row c, Elimination e4,
                  Elimination e3, Elimination e2) {
    real low = real(-1000);
    real high = real(1000);
    for (uint l = 0u; l < count; ++l) {
        Row r = project(project(project(load_row(rows, base, l, row_count), e4, 4u), e3, 3u), e2, 2u);
        if (is_flat(r, 1u)) continue;
        real bound = divide(r.b, r.a[0]);
        if (r.a[0] > real(0))
            high = min(high, bound);
        else
            low = max(low, bound);
    }
    Row x;
    x.b = real(0);
    for (uint q = 0u; q < 4u; ++q) x.a[q] = real(0);
    x.a[0] = c.a[0] > real(0) ? high : low;
    return x;
}

FN Row solve_plane(RealArray rows, uint base, uint count, uint row_count, Row c, Elimination e4,
                   Elimination e3) {
    Row x = far_corner(c, 2u);
    for (uint k = 0u; k < count; ++k) {
        Row r = project(project(load_row(rows, base, k, row_count), e4, 4u), e3, 3u);
        if (is_flat(r, 2u) || !is_violated(r, x, 2u)) continue;
        Elimination e2 = eliminate(r, 2u);
        x = lift(solve_line(rows, base, k, row_count, project(c, e2, 2u), e4, e3, e2), e2, 2u);
    }
    return x;
}

FN Row solve_space(RealArray rows, uint base, uint count, uint row_count, Row c, Elimination e4) {
    Row x = far_corner(c, 3u);
    for (uint j = 0u; j < count; ++j) {
        Row r = project(load_row(rows, base, j, row_count), e4, 4u);
        if (is_flat(r, 3u) || !is_violated(r, x, 3u)) continue;
        Elimination e3 = eliminate(r, 3u);
        x = lift(solve_plane(rows, base, j, row_count, project(c, e3, 3u), e4, e3), e3, 3u);
    }
    return x;
}

// The optimum of the first row_count rows.
FN Row solve_working_set(RealArray rows, uint base, uint row_count) {
    Row c;
    c.b = real(0);
    c.a[0] = real(0);
    c.a[1] = real(0);
    c.a[2] = real(0);
    c.a[3] = real(1);
    Row x = far_corner(c, 4u);
    for (uint i = 0u; i < row_count; ++i) {
        Row r = load_row(rows, base, i, row_count);
        if (!is_violated(r, x, 4u)) continue;
        Elimination e4 = eliminate(r, 4u);
        x = lift(solve_space(rows, base, i, row_count, project(c, e4, 4u), e4), e4, 4u);
    }
    return x;
}

FN void swap_rows(RealArray rows, uint base, uint i, uint j) {
    for (uint q = 0u; q < 4u; ++q) {
        real saved = rows.at[4u * (base + i) + q];
        rows.at[4u * (base + i) + q] = rows.at[4u * (base + j) + q];
        rows.at[4u * (base + j) + q] = saved;
    }
}

// Starts with the box and adds the row that is violated most until none is: few rows bind, and Mesa's
// software device ends a shader's loops after 65,535 rounds, which the whole list in one program can exceed.
FN Row solve_program(RealArray rows, uint base, uint row_count) {
    uint working = 6u;
    Row x = solve_working_set(rows, base, working);
    while (working < row_count) {
        uint worst = row_count;
        real most = real(1.0e-11);
        for (uint i = working; i < row_count; ++i) {
            uint k = 4u * (base + i);
            real over = rows.at[k] * x.a[0] + rows.at[k + 1u] * x.a[1] + rows.at[k + 2u] * x.a[2] + x.a[3] -
                        rows.at[k + 3u];
            if (over > most) {
                most = over;
                worst = i;
            }
        }
        if (worst == row_count) break;
        swap_rows(rows, base, working, worst);
        working += 1u;
        x = solve_working_set(rows, base, working);
    }
    return x;
}

KERNEL_BODY(untangle_vertex) {
    uint dof = dof_list.at[gid];
    uint base = scratch_offset.at[gid];
    real shortest = real(1.0e30);
    for (uint i = ball_offset.at[dof]; i < ball_offset.at[dof + 1u]; ++i)
        shortest = min(shortest, divide(real(1), inverse_length.at[ball_item.at[2u * i]]));
    // Displacements in units of the shortest target length.
    real here = real(1.0e30);
    uint row_count = 6u;
    for (uint i = ball_offset.at[dof]; i < ball_offset.at[dof + 1u]; ++i) {
        uint cell = ball_item.at[2u * i];
        real inverse = inverse_length.at[cell];
        HexEdges h = load_edges(points, cells, cell, inverse);
        EdgeShares s = edge_shares(pattern, ball_item.at[2u * i + 1u], inverse * shortest);
        for (uint t = 0u; t < 32u; ++t) {
            LocalTet tet = local_tet(h, s, t);
            real size = sqrt(dot(tet.g, tet.g));
            if (!(size > real(1.0e-9))) continue;
            real scale = divide(real(1), size);
            uint k = 4u * (base + row_count);
            scratch.at[k] = -tet.g.x * scale;
            scratch.at[k + 1u] = -tet.g.y * scale;
            scratch.at[k + 2u] = -tet.g.z * scale;
            scratch.at[k + 3u] = tet.jacobian * scale;
            here = min(here, tet.jacobian * scale);
            row_count += 1u;
        }
    }
    for (uint side = 0u; side < 6u; ++side) {
        uint k = 4u * (base + side);
        real sign = (side & 1u) == 0u ? real(2) : real(-2);
        scratch.at[k] = side < 2u ? sign : real(0);
        scratch.at[k + 1u] = side >= 2u && side < 4u ? sign : real(0);
        scratch.at[k + 2u] = side >= 4u ? sign : real(0);
        scratch.at[k + 3u] = real(2) * real(box_rel);
    }
    Row x = solve_program(scratch, base, row_count);
    bool deeper = x.a[3] > here;
    depth.at[dof] = deeper ? x.a[3] : here;
    uint v = dof_vertex.at[dof];
    if (deeper) points.at[v] = points.at[v] + widen(rvec3(x.a[0], x.a[1], x.a[2]) * shortest);
}
