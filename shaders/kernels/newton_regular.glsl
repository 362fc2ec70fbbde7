// newton_vertex for a vertex inside a regular block of 2 x 2 x 2 cells: each of the 26 vertices round it is loaded once,
// and chosen from by octant, where newton_vertex loads those of every cell twice.

// The vertices relative to the middle one, x + 3 y + 9 z.
struct Block {
    rvec3 p[27];
};

FN rvec3 pick(bool low, rvec3 a, rvec3 b) {
    return rvec3(sel(low, a.x, b.x), sel(low, a.y, b.y), sel(low, a.z, b.z));
}

// Octant x + 2 y + 4 z, 1 where a direction is negative; x and y change places where the octant is mirrored.
FN CornerEdges octant_edges(Block b, uint octant, real inverse) {
    bool x = (octant & 1u) == 1u;
    bool y = (octant & 2u) == 2u;
    bool z = (octant & 4u) == 4u;
    rvec3 p100 = pick(x, b.p[12], b.p[14]);
    rvec3 p010 = pick(y, b.p[10], b.p[16]);
    rvec3 p001 = pick(z, b.p[4], b.p[22]);
    rvec3 p110 = pick(y, pick(x, b.p[9], b.p[11]), pick(x, b.p[15], b.p[17]));
    rvec3 p101 = pick(z, pick(x, b.p[3], b.p[5]), pick(x, b.p[21], b.p[23]));
    rvec3 p011 = pick(z, pick(y, b.p[1], b.p[7]), pick(y, b.p[19], b.p[25]));
    rvec3 p111 = pick(z, pick(y, pick(x, b.p[0], b.p[2]), pick(x, b.p[6], b.p[8])),
                      pick(y, pick(x, b.p[18], b.p[20]), pick(x, b.p[24], b.p[26])));
    bool odd = (x != y) != z;
    return corner_edges(pick(odd, p010, p100) * inverse, pick(odd, p100, p010) * inverse, p110 * inverse,
                        p001 * inverse, pick(odd, p011, p101) * inverse, pick(odd, p101, p011) * inverse,
                        p111 * inverse);
}

KERNEL_BODY(newton_regular) {
    uint k = 35u * gid;
    uint v = stencil.at[k + 13u];
    pvec3 o = points.at[v];
    Block b;
#define HEXOPT_LOAD(i) b.p[i] = narrow(points.at[stencil.at[k + uint(i)]] - o);
#define HEXOPT_LOAD_ROW(i) HEXOPT_LOAD(i) HEXOPT_LOAD(i + 1) HEXOPT_LOAD(i + 2)
#define HEXOPT_LOAD_LAYER(i) HEXOPT_LOAD_ROW(i) HEXOPT_LOAD_ROW(i + 3) HEXOPT_LOAD_ROW(i + 6)
    HEXOPT_LOAD_LAYER(0)
    HEXOPT_LOAD_LAYER(9)
    HEXOPT_LOAD_LAYER(18)
#undef HEXOPT_LOAD_LAYER
#undef HEXOPT_LOAD_ROW
#undef HEXOPT_LOAD
    LocalModel m = model_zero();
    for (uint octant = 0u; octant < 8u; ++octant) {
        uint cell = stencil.at[k + 27u + octant];
        real inverse = inverse_length.at[cell];
        real factor = cell_weight.at[cell];
        LocalModel part = corner_model(octant_edges(b, octant, inverse), real(eps));
        m.energy += part.energy * factor;
        m.gradient = m.gradient + part.gradient * (factor * inverse);
        m.hessian = add_scaled(m.hessian, part.hessian, factor * inverse * inverse);
    }
    rvec3 d = newton_step(m);
    real slope = dot(m.gradient, d);
    if (!(slope < real(0))) return;
    LineEnergies l = line_zero();
    for (uint octant = 0u; octant < 8u; ++octant) {
        uint cell = stencil.at[k + 27u + octant];
        real inverse = inverse_length.at[cell];
        l = add_lines(l, corner_line(octant_edges(b, octant, inverse), d * inverse, real(omega), real(eps)),
                      cell_weight.at[cell]);
    }
    points.at[v] = o + widen(d * search_length(l, m.energy, slope, real(omega)));
}
