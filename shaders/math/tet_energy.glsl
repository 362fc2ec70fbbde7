// The regularised shape energy of one tetrahedron of a hexahedron (Garanzha et al. 2021; docs/optimize.md).
// A tetrahedron is three edges of its hexahedron, one along xi, eta and zeta each, divided by the cell's target
// lengths, so that J = det(a, b, c) is 1 at the ideal cell.

// x^(-1/3) for normal x > 0 to rounding level: bit seed and Householder steps of third order.
FN real rcbrt(real x) {
    real y = rcbrt_seed(x);
    real h = real(1) - x * y * y * y;
    y = y + y * h * (real(0.33333333333333333) + h * real(0.22222222222222222));
    h = real(1) - x * y * y * y;
    y = y + y * h * (real(0.33333333333333333) + h * real(0.22222222222222222));
    h = real(1) - x * y * y * y;
    return y + y * h * real(0.33333333333333333);
}

FN real tet_jacobian(rvec3 a, rvec3 b, rvec3 c) { return dot(a, cross(b, c)); }

struct TetShape {
    real energy;    // S / (3 chi^(2/3)), 1 at the cube
    real jacobian;  // J
    real scale;     // h = chi^(-2/3) / 3
    real inv_s;     // chi'/chi = 1 / sqrt(J^2 + eps^2)
};

// chi = (J + sqrt(J^2 + eps^2)) / 2 without cancellation for J <= 0.
FN real regularised_jacobian(real j, real s, real eps) {
    rbool positive = j > real(0);
    return sel(positive, real(0.5) * (j + s), divide(real(0.5) * eps * eps, sel(positive, real(1), s - j)));
}

// size2 = S = |a|^2 + |b|^2 + |c|^2.
FN TetShape tet_shape(real size2, real j, real eps) {
    TetShape t;
    real s = sqrt(j * j + eps * eps);
    real root = rcbrt(regularised_jacobian(j, s, eps));
    t.jacobian = j;
    t.scale = root * root * real(0.33333333333333333);
    t.energy = size2 * t.scale;
    t.inv_s = divide(real(1), s);
    return t;
}

// dE/de = 2 h e + gradient_factor * dJ/de for each edge e.
FN real tet_gradient_factor(TetShape t) { return real(-0.66666666666666667) * t.energy * t.inv_s; }

// Positive semidefinite Hessian model in edge space (terms with chi'' and d2J dropped):
// 2 h I + alpha (e G^T + G e^T) + beta G G^T over the three edges, G = dJ/de.
FN real tet_hessian_alpha(TetShape t) { return real(-1.3333333333333333) * t.scale * t.inv_s; }
FN real tet_hessian_beta(TetShape t) { return real(1.1111111111111111) * t.energy * t.inv_s * t.inv_s; }
