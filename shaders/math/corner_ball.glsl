// The 16 tetrahedra of a hexahedron that depend on one of its corners, and the energy's dependence on the
// corner's displacement. The corner lies at the origin of a frame turned so that it is corner (0, 0, 0).

// A tetrahedron as a function of one dof's displacement d: J(d) = jacobian + g.d (affine), S(d) = size2 + 2
// x.d + l2 d.d
struct LocalTet {
    real jacobian;
    real size2;
    rvec3 g;
    rvec3 x;
    real l2;
};

// Energy with its gradient and semidefinite Hessian model by the displacement.
struct LocalModel {
    real energy;
    rvec3 gradient;
    Sym3 hessian;
};

FN LocalModel model_zero() {
    LocalModel m;
    m.energy = real(0);
    m.gradient = rzero();
    m.hessian = sym_zero();
    return m;
}

FN LocalModel add_tet(LocalModel m, LocalTet tet, real eps, real factor) {
    TetShape shape = tet_shape(tet.size2, tet.jacobian, eps);
    m.energy += shape.energy * factor;
    m.gradient = m.gradient + (tet.x * (real(2) * shape.scale) + tet.g * tet_gradient_factor(shape)) * factor;
    m.hessian = add_identity(m.hessian, real(2) * shape.scale * tet.l2 * factor);
    m.hessian = add_outer(m.hessian, tet.x, tet.g, real(2) * tet_hessian_alpha(shape) * factor);
    m.hessian = add_outer(m.hessian, tet.g, tet.g, tet_hessian_beta(shape) * factor);
    return m;
}

// Energies at the six lengths of a line search: omega, 1, 0.4, 0.16, ... times a step.
struct LineEnergies {
    real e0, e1, e2, e3, e4, e5;
};

FN LineEnergies line_zero() {
    LineEnergies l;
    l.e0 = real(0);
    l.e1 = real(0);
    l.e2 = real(0);
    l.e3 = real(0);
    l.e4 = real(0);
    l.e5 = real(0);
    return l;
}

FN real energy_at(LocalTet tet, real j1, real s1, real s2, real a, real eps) {
    return tet_shape(tet.size2 + a * (s1 + a * s2), tet.jacobian + a * j1, eps).energy;
}

// d2 = d.d
FN real tet_energy_at(LocalTet tet, rvec3 d, real d2, real eps) {
    return energy_at(tet, dot(tet.g, d), real(2) * dot(tet.x, d), tet.l2 * d2, real(1), eps);
}

// d2 = d.d
FN LineEnergies add_line(LineEnergies l, LocalTet tet, rvec3 d, real d2, real omega, real eps, real factor) {
    real j1 = dot(tet.g, d);
    real s1 = real(2) * dot(tet.x, d);
    real s2 = tet.l2 * d2;
    l.e0 += factor * energy_at(tet, j1, s1, s2, omega, eps);
    l.e1 += factor * energy_at(tet, j1, s1, s2, real(1), eps);
    l.e2 += factor * energy_at(tet, j1, s1, s2, real(0.4), eps);
    l.e3 += factor * energy_at(tet, j1, s1, s2, real(0.16), eps);
    l.e4 += factor * energy_at(tet, j1, s1, s2, real(0.064), eps);
    l.e5 += factor * energy_at(tet, j1, s1, s2, real(0.0256), eps);
    return l;
}

FN LineEnergies add_lines(LineEnergies l, LineEnergies m, real f) {
    l.e0 += f * m.e0;
    l.e1 += f * m.e1;
    l.e2 += f * m.e2;
    l.e3 += f * m.e3;
    l.e4 += f * m.e4;
    l.e5 += f * m.e5;
    return l;
}

FN rbool accepts(real energy, real before, real slope, real length) {
    return energy < before + real(1.0e-4) * length * slope;
}

// The longest of 1, 0.4, ... that lowers the energy enough (Armijo), else 0; omega in place of 1 where that
// lowers it.
FN real search_length(LineEnergies l, real before, real slope, real omega) {
    real length = sel(accepts(l.e5, before, slope, real(0.0256)), real(0.0256), real(0));
    length = sel(accepts(l.e4, before, slope, real(0.064)), real(0.064), length);
    length = sel(accepts(l.e3, before, slope, real(0.16)), real(0.16), length);
    length = sel(accepts(l.e2, before, slope, real(0.4)), real(0.4), length);
    real full = sel(l.e0 < before, omega, real(1));
    return sel(accepts(l.e1, before, slope, real(1)), full, length);
}

// Step of a Newton method on the model.
FN rvec3 newton_step(LocalModel m) { return solve(m.hessian, -m.gradient, real(1.0e-6)); }

// The corner's edges and those that complete its tetrahedra: x_yz runs along x at (y, z), y_xz and z_xy
// likewise.
struct CornerEdges {
    rvec3 x00, x10, x01, x11;
    rvec3 y00, y10, y01, y11;
    rvec3 z00, z10, z01, z11;
};

// p_xyz: the other corners relative to the corner.
FN CornerEdges corner_edges(rvec3 p100, rvec3 p010, rvec3 p110, rvec3 p001, rvec3 p101, rvec3 p011,
                            rvec3 p111) {
    CornerEdges e;
    e.x00 = p100;
    e.x10 = p110 - p010;
    e.x01 = p101 - p001;
    e.x11 = p111 - p011;
    e.y00 = p010;
    e.y10 = p110 - p100;
    e.y01 = p011 - p001;
    e.y11 = p111 - p101;
    e.z00 = p001;
    e.z10 = p101 - p100;
    e.z01 = p011 - p010;
    e.z11 = p111 - p110;
    return e;
}

// Tetrahedra of edges a, b, c (right-handed) of which the first one, two or all three start at the corner.
FN LocalTet corner_tet1(rvec3 a, rvec3 b, rvec3 c) {
    LocalTet t;
    rvec3 ga = cross(b, c);
    t.jacobian = dot(a, ga);
    t.size2 = dot(a, a) + dot(b, b) + dot(c, c);
    t.g = -ga;
    t.x = -a;
    t.l2 = real(1);
    return t;
}

FN LocalTet corner_tet2(rvec3 a, rvec3 b, rvec3 c) {
    LocalTet t;
    rvec3 ga = cross(b, c);
    t.jacobian = dot(a, ga);
    t.size2 = dot(a, a) + dot(b, b) + dot(c, c);
    t.g = -(ga + cross(c, a));
    t.x = -(a + b);
    t.l2 = real(2);
    return t;
}

FN LocalTet corner_tet3(rvec3 a, rvec3 b, rvec3 c) {
    LocalTet t;
    rvec3 ga = cross(b, c);
    t.jacobian = dot(a, ga);
    t.size2 = dot(a, a) + dot(b, b) + dot(c, c);
    t.g = -(ga + cross(c, a) + cross(a, b));
    t.x = -(a + b + c);
    t.l2 = real(3);
    return t;
}

// VISIT(tetrahedron) for each of the 16: four corner tetrahedra, then the paths with the middle edge along y,
// x and z.
// clang-format off
#define HEXOPT_CORNER_TETS(e, VISIT) \
    VISIT(corner_tet3(e.x00, e.y00, e.z00)) \
    VISIT(corner_tet1(e.x00, e.y10, e.z10)) \
    VISIT(corner_tet1(e.y00, e.z01, e.x10)) \
    VISIT(corner_tet1(e.z00, e.x01, e.y01)) \
    VISIT(corner_tet2(e.x00, e.y00, e.z01)) \
    VISIT(corner_tet1(e.x00, e.y10, e.z11)) \
    VISIT(corner_tet2(e.y00, e.z00, e.x10)) \
    VISIT(corner_tet1(e.z00, e.x11, e.y01)) \
    VISIT(corner_tet2(e.x00, e.y00, e.z10)) \
    VISIT(corner_tet2(e.z00, e.x00, e.y10)) \
    VISIT(corner_tet1(e.y00, e.z11, e.x10)) \
    VISIT(corner_tet1(e.z00, e.x01, e.y11)) \
    VISIT(corner_tet2(e.z00, e.x00, e.y01)) \
    VISIT(corner_tet1(e.x00, e.y11, e.z10)) \
    VISIT(corner_tet2(e.y00, e.z00, e.x01)) \
    VISIT(corner_tet1(e.y00, e.z01, e.x11))
// clang-format on

// Model of a cell's corner by the displacement over the cell's target length, and the energies along it.
FN LocalModel corner_model(CornerEdges e, real eps) {
    LocalModel m = model_zero();
#define HEXOPT_VISIT(tet) m = add_tet(m, tet, eps, real(1));
    HEXOPT_CORNER_TETS(e, HEXOPT_VISIT)
#undef HEXOPT_VISIT
    return m;
}

FN LineEnergies corner_line(CornerEdges e, rvec3 d, real omega, real eps) {
    LineEnergies l = line_zero();
    real d2 = dot(d, d);
#define HEXOPT_VISIT(tet) l = add_line(l, tet, d, d2, omega, eps, real(1));
    HEXOPT_CORNER_TETS(e, HEXOPT_VISIT)
#undef HEXOPT_VISIT
    return l;
}

// Energy of a cell's corner with the corner moved by d.
FN real corner_energy(CornerEdges e, rvec3 d, real eps) {
    real sum = real(0);
    real d2 = dot(d, d);
#define HEXOPT_VISIT(tet) sum += tet_energy_at(tet, d, d2, eps);
    HEXOPT_CORNER_TETS(e, HEXOPT_VISIT)
#undef HEXOPT_VISIT
    return sum;
}
