// Symmetric 3x3 matrices.

FN rvec3 rzero() { return rvec3(real(0), real(0), real(0)); }

struct Sym3 {
    real xx, xy, xz, yy, yz, zz;
};

FN Sym3 sym_zero() {
    Sym3 m;
    m.xx = real(0);
    m.xy = real(0);
    m.xz = real(0);
    m.yy = real(0);
    m.yz = real(0);
    m.zz = real(0);
    return m;
}

// m + f (p q^T + q p^T) / 2
FN Sym3 add_outer(Sym3 m, rvec3 p, rvec3 q, real f) {
    real h = real(0.5) * f;
    m.xx += f * p.x * q.x;
    m.xy += h * (p.x * q.y + p.y * q.x);
    m.xz += h * (p.x * q.z + p.z * q.x);
    m.yy += f * p.y * q.y;
    m.yz += h * (p.y * q.z + p.z * q.y);
    m.zz += f * p.z * q.z;
    return m;
}

// f p p^T. Not added to a zero matrix: drivers leave such an addition out, and with it the sign of a zero.
FN Sym3 outer(rvec3 p, real f) {
    Sym3 m;
    m.xx = f * p.x * p.x;
    m.xy = f * p.x * p.y;
    m.xz = f * p.x * p.z;
    m.yy = f * p.y * p.y;
    m.yz = f * p.y * p.z;
    m.zz = f * p.z * p.z;
    return m;
}

FN Sym3 add_identity(Sym3 m, real f) {
    m.xx += f;
    m.yy += f;
    m.zz += f;
    return m;
}

FN Sym3 add_scaled(Sym3 m, Sym3 n, real f) {
    m.xx += f * n.xx;
    m.xy += f * n.xy;
    m.xz += f * n.xz;
    m.yy += f * n.yy;
    m.yz += f * n.yz;
    m.zz += f * n.zz;
    return m;
}

FN real trace(Sym3 m) { return m.xx + m.yy + m.zz; }

FN rvec3 times(Sym3 m, rvec3 v) {
    return rvec3(m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
                 m.xz * v.x + m.yz * v.y + m.zz * v.z);
}

// Solves m x = b for positive semidefinite m by L D L^T with pivots kept above `floor_rel` of the trace.
FN rvec3 solve(Sym3 m, rvec3 b, real floor_rel) {
    real least = max(floor_rel * trace(m), real(1.0e-30));
    real d0 = max(m.xx, least);
    real l1 = divide(m.xy, d0);
    real l2 = divide(m.xz, d0);
    real d1 = max(m.yy - l1 * m.xy, least);
    real l3 = divide(m.yz - l2 * m.xy, d1);
    real d2 = max(m.zz - l2 * m.xz - l3 * l3 * d1, least);
    real y1 = b.y - l1 * b.x;
    real y2 = b.z - l2 * b.x - l3 * y1;
    real z = divide(y2, d2);
    real y = divide(y1, d1) - l3 * z;
    real x = divide(b.x, d0) - l1 * y - l2 * z;
    return rvec3(x, y, z);
}
