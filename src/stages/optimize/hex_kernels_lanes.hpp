// Kernels on kLanes cells of a group at once. Included inside a namespace that defines real, rvec3 and the
// mathematics of shaders/math (hex_kernels_impl.hpp), once for float and once for double: no include guard.

struct LaneCells {
    rvec3 edge[12]; ///< hex::kEdgeVertex, in target units
    real inverse_length[3];
    real weight;
    bool all_tets;
    std::uint32_t mask[kLanes];
};

inline void store(const real& value, lane_real* to) {
    for (int lane = 0; lane < kLanes; ++lane) to[lane] = value[lane];
}

/// Loads the cells first..first+kLanes-1 of the group; places past its end repeat the last cell.
inline void load(const HexGroup& group, int first, LaneCells& out) {
    alignas(64) lane_real local[24][kLanes];
    alignas(64) lane_real length[3][kLanes];
    alignas(64) lane_real weight[kLanes];
    out.all_tets = true;
    for (int lane = 0; lane < kLanes; ++lane) {
        const int c = first + lane < group.count ? first + lane : group.count - 1;
        const std::size_t place = group.cell_id ? group.cell_id[c] : static_cast<std::size_t>(c);
        const Cell& cell = group.cells[place];
        const Point origin = group.positions[cell[0]];
        for (int v = 0; v < 8; ++v) {
            const Point p = group.positions[cell[v]] - origin;
            for (int axis = 0; axis < 3; ++axis) local[3 * v + axis][lane] = static_cast<lane_real>(p[axis]);
        }
        for (std::size_t d = 0; d < 3; ++d)
            length[d][lane] = static_cast<lane_real>(
                group.inverse_length[c] * (group.inverse_stretch ? group.inverse_stretch[3 * place + d] : 1));
        weight[lane] = static_cast<lane_real>(group.weight[c]);
        out.mask[lane] = group.tet_mask[c];
        out.all_tets = out.all_tets && out.mask[lane] == ~0u;
    }
    const auto pack = [](const lane_real* from) {
        real r;
        __builtin_memcpy(&r.v, from, sizeof r.v);
        return r;
    };
    for (int d = 0; d < 3; ++d) out.inverse_length[d] = pack(length[d]);
    out.weight = pack(weight);
    for (int e = 0; e < 12; ++e) {
        const int a = 3 * hex::kEdgeVertex[e][0], b = 3 * hex::kEdgeVertex[e][1];
        const rvec3 vector(pack(local[b]) - pack(local[a]), pack(local[b + 1]) - pack(local[a + 1]),
                           pack(local[b + 2]) - pack(local[a + 2]));
        out.edge[e] = vector * out.inverse_length[e / 4];
    }
}

/// 1 in the lanes where tetrahedron t counts, else 0.
inline real tet_counts(const LaneCells& cells, int t) {
    real r(1);
    if (!cells.all_tets)
        for (int lane = 0; lane < kLanes; ++lane)
            r.set(lane, static_cast<lane_real>(cells.mask[lane] >> t & 1u));
    return r;
}

struct LaneTet {
    rvec3 a, b, c;    ///< edges along xi, eta, zeta
    rvec3 ga, gb, gc; ///< dJ/da, dJ/db, dJ/dc
    real jacobian;
    real counts;
};

inline LaneTet make_tet(const LaneCells& cells, int t, const real* length2, const real& size_weight, real& size2) {
    LaneTet tet;
    const auto& e = hex::kTetEdge[t];
    tet.a = cells.edge[e[0]];
    tet.b = cells.edge[e[1]];
    tet.c = cells.edge[e[2]];
    tet.ga = cross(tet.b, tet.c);
    tet.gb = cross(tet.c, tet.a);
    tet.gc = cross(tet.a, tet.b);
    size2 = length2[e[0]] + length2[e[1]] + length2[e[2]] + size_weight;
    tet.counts = tet_counts(cells, t);
    tet.jacobian = sel(tet.counts > real(0), dot(tet.a, tet.ga), real(1));
    return tet;
}

inline void edge_lengths2(const LaneCells& cells, real* length2) {
    for (int e = 0; e < 12; ++e) length2[e] = dot(cells.edge[e], cells.edge[e]);
}

/// A penalised corner: d = (theta - SJ)+ and q_k = dSJ/de_k.
struct LanePenalty {
    real d;
    rvec3 qa, qb, qc;
};

inline LanePenalty make_penalty(const LaneTet& tet, const real* length2, int t, real theta) {
    const auto& e = hex::kTetEdge[t];
    LanePenalty p;
    const real tiny(lane_real(1e-30));
    const real la = max(length2[e[0]], tiny), lb = max(length2[e[1]], tiny), lc = max(length2[e[2]], tiny);
    const real inverse = real(1) / (sqrt(la) * sqrt(lb) * sqrt(lc));
    const real sj = tet.jacobian * inverse;
    p.d = max(theta - sj, real(0)) * tet.counts;
    p.qa = tet.ga * inverse - tet.a * (sj / la);
    p.qb = tet.gb * inverse - tet.b * (sj / lb);
    p.qc = tet.gc * inverse - tet.c * (sj / lc);
    return p;
}

inline bool is_corner_tet(int t) { return t % 4 == 0; }

inline void lanes_value(const HexGroup& group, int first, HexValue& out) {
    LaneCells cells;
    load(group, first, cells);
    real length2[12];
    edge_lengths2(cells, length2);
    const real eps(group.eps), theta(group.theta), penalty_weight(group.penalty_weight),
        size_weight(group.size_weight);
    real energy(0), penalty(0), least(lane_real(sizeof(lane_real) == 4 ? 1e38 : 1e300));
    for (int t = 0; t < 32; ++t) {
        real size2;
        const LaneTet tet = make_tet(cells, t, length2, size_weight, size2);
        energy += tet_shape(size2, tet.jacobian, eps).energy * tet.counts;
        least = min(least, sel(tet.counts > real(0), tet.jacobian, least));
        if (group.penalty_weight > 0 && is_corner_tet(t)) {
            const real d = make_penalty(tet, length2, t, theta).d;
            penalty += d * d;
        }
    }
    energy = energy * (cells.weight * real(group.shape_weight)) + penalty * penalty_weight;
    for (int lane = 0; lane < kLanes; ++lane) {
        out.energy[first + lane] = energy[lane];
        out.min_jacobian[first + lane] = least[lane];
    }
}

inline void lanes_gradient(const HexGroup& group, int first, HexGradient& out) {
    LaneCells cells;
    load(group, first, cells);
    real length2[12];
    edge_lengths2(cells, length2);
    const real eps(group.eps), theta(group.theta), penalty_weight(group.penalty_weight),
        size_weight(group.size_weight);
    const real factor = cells.weight * real(group.shape_weight);
    real energy(0), penalty(0), least(lane_real(sizeof(lane_real) == 4 ? 1e38 : 1e300));
    rvec3 slope[12];
    for (auto& s : slope) s = rvec3(real(0), real(0), real(0));
    for (int t = 0; t < 32; ++t) {
        const auto& e = hex::kTetEdge[t];
        real size2;
        const LaneTet tet = make_tet(cells, t, length2, size_weight, size2);
        const TetShape shape = tet_shape(size2, tet.jacobian, eps);
        energy += shape.energy * tet.counts;
        least = min(least, sel(tet.counts > real(0), tet.jacobian, least));
        const real along = real(2) * shape.scale * factor * tet.counts;
        const real across = tet_gradient_factor(shape) * factor * tet.counts;
        slope[e[0]] = slope[e[0]] + tet.a * along + tet.ga * across;
        slope[e[1]] = slope[e[1]] + tet.b * along + tet.gb * across;
        slope[e[2]] = slope[e[2]] + tet.c * along + tet.gc * across;
        if (group.penalty_weight > 0 && is_corner_tet(t)) {
            const LanePenalty p = make_penalty(tet, length2, t, theta);
            penalty += p.d * p.d;
            const real down = real(-2) * penalty_weight * p.d;
            slope[e[0]] = slope[e[0]] + p.qa * down;
            slope[e[1]] = slope[e[1]] + p.qb * down;
            slope[e[2]] = slope[e[2]] + p.qc * down;
        }
    }
    energy = energy * factor + penalty * penalty_weight;
    rvec3 vertex[8];
    for (auto& v : vertex) v = rvec3(real(0), real(0), real(0));
    for (int e = 0; e < 12; ++e) {
        const rvec3 s = slope[e] * cells.inverse_length[e / 4];
        vertex[hex::kEdgeVertex[e][1]] = vertex[hex::kEdgeVertex[e][1]] + s;
        vertex[hex::kEdgeVertex[e][0]] = vertex[hex::kEdgeVertex[e][0]] - s;
    }
    for (int lane = 0; lane < kLanes; ++lane) {
        out.value.energy[first + lane] = energy[lane];
        out.value.min_jacobian[first + lane] = least[lane];
        for (int v = 0; v < 8; ++v) {
            out.gradient[3 * v][first + lane] = vertex[v].x[lane];
            out.gradient[3 * v + 1][first + lane] = vertex[v].y[lane];
            out.gradient[3 * v + 2][first + lane] = vertex[v].z[lane];
        }
    }
}

/// 3x3 block of packs, row by row.
struct LaneBlock {
    real m[9];
};

/// block += p q^T + r s^T
inline void add_outer2(LaneBlock& block, const rvec3& p, const rvec3& q, const rvec3& r, const rvec3& s) {
    block.m[0] += p.x * q.x + r.x * s.x;
    block.m[1] += p.x * q.y + r.x * s.y;
    block.m[2] += p.x * q.z + r.x * s.z;
    block.m[3] += p.y * q.x + r.y * s.x;
    block.m[4] += p.y * q.y + r.y * s.y;
    block.m[5] += p.y * q.z + r.y * s.z;
    block.m[6] += p.z * q.x + r.z * s.x;
    block.m[7] += p.z * q.y + r.z * s.y;
    block.m[8] += p.z * q.z + r.z * s.z;
}

inline void add_outer(LaneBlock& block, const rvec3& p, const rvec3& q) {
    block.m[0] += p.x * q.x;
    block.m[1] += p.x * q.y;
    block.m[2] += p.x * q.z;
    block.m[3] += p.y * q.x;
    block.m[4] += p.y * q.y;
    block.m[5] += p.y * q.z;
    block.m[6] += p.z * q.x;
    block.m[7] += p.z * q.y;
    block.m[8] += p.z * q.z;
}

/// Hessian in edge space: 12 diagonal blocks, and for each pair of directions the 4x4 blocks between their
/// edges.
struct EdgeHessian {
    LaneBlock diagonal[12];
    LaneBlock cross[3][4][4]; ///< directions (xi, eta), (xi, zeta), (eta, zeta)
};

inline void add_tet(EdgeHessian& h, int t, const LaneTet& tet, const TetShape& shape, const real& factor) {
    const auto& e = hex::kTetEdge[t];
    const real alpha = tet_hessian_alpha(shape) * factor,
               half_beta = real(0.5) * tet_hessian_beta(shape) * factor;
    const real twice_h = real(2) * shape.scale * factor;
    // alpha (x_k g_l^T + g_k x_l^T) + beta g_k g_l^T = y_k g_l^T + g_k y_l^T with y = alpha x + beta / 2 g
    const rvec3 ya = tet.a * alpha + tet.ga * half_beta;
    const rvec3 yb = tet.b * alpha + tet.gb * half_beta;
    const rvec3 yc = tet.c * alpha + tet.gc * half_beta;
    add_outer2(h.diagonal[e[0]], ya, tet.ga, tet.ga, ya);
    add_outer2(h.diagonal[e[1]], yb, tet.gb, tet.gb, yb);
    add_outer2(h.diagonal[e[2]], yc, tet.gc, tet.gc, yc);
    for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 9; axis += 4) h.diagonal[e[k]].m[axis] += twice_h;
    add_outer2(h.cross[0][e[0]][e[1] - 4], ya, tet.gb, tet.ga, yb);
    add_outer2(h.cross[1][e[0]][e[2] - 8], ya, tet.gc, tet.ga, yc);
    add_outer2(h.cross[2][e[1] - 4][e[2] - 8], yb, tet.gc, tet.gb, yc);
}

/// Gauss-Newton Hessian of the penalty: 2 W q q^T where the corner is penalised.
inline void add_penalty(EdgeHessian& h, int t, const LanePenalty& p, const real& weight) {
    const auto& e = hex::kTetEdge[t];
    const real w = sel(p.d > real(0), real(2) * weight, real(0));
    const rvec3 wa = p.qa * w, wb = p.qb * w, wc = p.qc * w;
    add_outer(h.diagonal[e[0]], wa, p.qa);
    add_outer(h.diagonal[e[1]], wb, p.qb);
    add_outer(h.diagonal[e[2]], wc, p.qc);
    add_outer(h.cross[0][e[0]][e[1] - 4], wa, p.qb);
    add_outer(h.cross[1][e[0]][e[2] - 8], wa, p.qc);
    add_outer(h.cross[2][e[1] - 4][e[2] - 8], wb, p.qc);
}

/// out(row, col) += sign * block, on the upper triangle.
inline void scatter(LaneBlock* out, int row, int col, const LaneBlock& block, bool plus) {
    const auto add = [&](LaneBlock& to, bool transposed) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const real& value = block.m[transposed ? 3 * j + i : 3 * i + j];
                if (plus)
                    to.m[3 * i + j] += value;
                else
                    to.m[3 * i + j] -= value;
            }
    };
    if (row <= col) add(out[hessian_block(row, col)], false);
    if (row >= col) add(out[hessian_block(col, row)], true);
}

/// From edge differences to vertices: an edge is its second vertex minus its first, over the target length.
inline void edges_to_vertices(const EdgeHessian& h, const LaneCells& cells, LaneBlock* out) {
    const auto scaled = [](const LaneBlock& block, const real& factor) {
        LaneBlock r;
        for (int i = 0; i < 9; ++i) r.m[i] = block.m[i] * factor;
        return r;
    };
    for (int e = 0; e < 12; ++e) {
        const real f = cells.inverse_length[e / 4];
        const LaneBlock block = scaled(h.diagonal[e], f * f);
        const int a = hex::kEdgeVertex[e][0], b = hex::kEdgeVertex[e][1];
        for (int i = 0; i < 9; ++i) {
            out[hessian_block(a, a)].m[i] += block.m[i];
            out[hessian_block(b, b)].m[i] += block.m[i];
            out[a < b ? hessian_block(a, b) : hessian_block(b, a)].m[i] -= block.m[i];
        }
    }
    constexpr int kDirections[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    for (int pair = 0; pair < 3; ++pair) {
        const real f =
            cells.inverse_length[kDirections[pair][0]] * cells.inverse_length[kDirections[pair][1]];
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                const LaneBlock block = scaled(h.cross[pair][i][j], f);
                const auto& p = hex::kEdgeVertex[4 * kDirections[pair][0] + i];
                const auto& q = hex::kEdgeVertex[4 * kDirections[pair][1] + j];
                for (int s = 0; s < 2; ++s)
                    for (int r = 0; r < 2; ++r) scatter(out, p[s], q[r], block, s == r);
            }
    }
}

inline void lanes_hessian(const HexGroup& group, int first, HexHessian& out) {
    LaneCells cells;
    load(group, first, cells);
    real length2[12];
    edge_lengths2(cells, length2);
    const real eps(group.eps), theta(group.theta), penalty_weight(group.penalty_weight),
        size_weight(group.size_weight);
    const real factor = cells.weight * real(group.shape_weight);
    EdgeHessian edges;
    __builtin_memset(&edges, 0, sizeof edges);
    for (int t = 0; t < 32; ++t) {
        real size2;
        const LaneTet tet = make_tet(cells, t, length2, size_weight, size2);
        add_tet(edges, t, tet, tet_shape(size2, tet.jacobian, eps), factor * tet.counts);
        if (group.penalty_weight > 0 && is_corner_tet(t))
            add_penalty(edges, t, make_penalty(tet, length2, t, theta), penalty_weight);
    }
    LaneBlock blocks[36];
    __builtin_memset(&blocks, 0, sizeof blocks);
    edges_to_vertices(edges, cells, blocks);
    for (int b = 0; b < 36; ++b)
        for (int i = 0; i < 9; ++i)
            for (int lane = 0; lane < kLanes; ++lane)
                out.block[9 * b + i][first + lane] = static_cast<float>(blocks[b].m[i][lane]);
}

inline void lanes_measure(const HexGroup& group, int first, HexMeasure& out) {
    LaneCells cells;
    load(group, first, cells);
    real length2[12];
    edge_lengths2(cells, length2);
    const real huge(lane_real(sizeof(lane_real) == 4 ? 1e38 : 1e300));
    real sj = huge, det8 = huge, det32 = huge;
    for (int t = 0; t < 32; ++t) {
        const auto& e = hex::kTetEdge[t];
        const rbool counts = tet_counts(cells, t) > real(0);
        const real j = tet_jacobian(cells.edge[e[0]], cells.edge[e[1]], cells.edge[e[2]]);
        det32 = min(det32, sel(counts, j, huge));
        if (!is_corner_tet(t)) continue;
        det8 = min(det8, sel(counts, j, huge));
        sj = min(sj, sel(counts, scaled_jacobian(j, length2[e[0]], length2[e[1]], length2[e[2]]), huge));
    }
    for (int lane = 0; lane < kLanes; ++lane) {
        out.min_sj[first + lane] = sj[lane];
        out.min_det8[first + lane] = det8[lane];
        out.min_det32[first + lane] = det32[lane];
    }
}
