// What the kernels on boundary vertices share: the closest point of the patch, curve or corner that a vertex is
// bound to, the energy that holds it within its range, and vectors and blocks restricted to what it may do.

// Elements of a surface: triangles, segments of curves as (a, b, b), corners as (a, a, a). Element e has its
// corners at element[6 e] and, behind them, what is interpolated to a direction: normals or tangents. Every patch,
// curve and corner has a tree of boxes, its nodes in preorder: box[2 n] the low and box[2 n + 1] the high end of
// node n, link[2 n] the node after its subtree, link[2 n + 1] one more than the element of a leaf, 0 inside.
struct Surface {
    PointArray box;
    IndexArray link;
    PointArray element;
};

FN Surface make_surface(PointArray box, IndexArray link, PointArray element) {
    Surface s;
    s.box = box;
    s.link = link;
    s.element = element;
    return s;
}

// Closest point of an element, with the weights of its second and third corner.
struct Foot {
    pvec3 point;
    preal distance2;
    preal w1, w2;
    uint element;
};

// Parameter 0..1 of the point of the segment from 0 along d that is closest to p.
FN preal segment_parameter(pvec3 p, pvec3 d) {
    preal along = dot(p, d);
    preal length2 = dot(d, d);
    if (!(along > preal(0))) return preal(0);
    if (along >= length2) return preal(1);
    return divide(along, length2);
}

// Weights of b and c where an edge of triangle abc is closest; p relative to a, d, e: edges ab and ac.
FN void edge_weights(pvec3 p, pvec3 d, pvec3 e, OUT(preal) w1, OUT(preal) w2) {
    preal t = segment_parameter(p, d);
    pvec3 r = p - d * t;
    preal best = dot(r, r);
    w1 = t;
    w2 = preal(0);
    t = segment_parameter(p, e);
    r = p - e * t;
    preal d2 = dot(r, r);
    if (d2 < best) {
        best = d2;
        w1 = preal(0);
        w2 = t;
    }
    t = segment_parameter(p - d, e - d);
    r = p - d - (e - d) * t;
    d2 = dot(r, r);
    if (d2 < best) {
        w1 = preal(1) - t;
        w2 = t;
    }
}

// By the Voronoi regions of the corners and the face (Ericson, Real-Time Collision Detection, 5.1.5); elsewhere,
// and without area, an edge is closest. Corners are returned exactly.
FN Foot element_foot(Surface s, uint element, pvec3 q) {
    pvec3 a = s.element.at[6u * element];
    pvec3 b = s.element.at[6u * element + 1u];
    pvec3 c = s.element.at[6u * element + 2u];
    pvec3 ab = b - a;
    pvec3 ac = c - a;
    pvec3 ap = q - a;
    pvec3 bp = q - b;
    pvec3 cp = q - c;
    preal ab_ap = dot(ab, ap);
    preal ac_ap = dot(ac, ap);
    preal ab_bp = dot(ab, bp);
    preal ac_bp = dot(ac, bp);
    preal ab_cp = dot(ab, cp);
    preal ac_cp = dot(ac, cp);
    preal va = ab_bp * ac_cp - ab_cp * ac_bp;
    preal vb = ab_cp * ac_ap - ab_ap * ac_cp;
    preal vc = ab_ap * ac_bp - ab_bp * ac_ap;
    Foot f;
    f.element = element;
    f.w1 = preal(0);
    f.w2 = preal(0);
    if (!(ab_ap <= preal(0) && ac_ap <= preal(0))) {
        if (ab_bp >= preal(0) && ac_bp <= ab_bp) {
            f.w1 = preal(1);
        } else if (ac_cp >= preal(0) && ab_cp <= ac_cp) {
            f.w2 = preal(1);
        } else if (va > preal(0) && vb > preal(0) && vc > preal(0)) {
            preal scale = divide(preal(1), va + vb + vc);
            f.w1 = vb * scale;
            f.w2 = vc * scale;
        } else {
            edge_weights(ap, ab, ac, f.w1, f.w2);
        }
    }
    f.point = a + ab * f.w1 + ac * f.w2;
    if (f.w1 == preal(1)) f.point = b;
    if (f.w2 == preal(1)) f.point = c;
    pvec3 r = q - f.point;
    f.distance2 = dot(r, r);
    return f;
}

FN preal box_distance2(Surface s, uint node, pvec3 q) {
    pvec3 low = s.box.at[2u * node];
    pvec3 high = s.box.at[2u * node + 1u];
    preal x = max(max(low.x - q.x, q.x - high.x), preal(0));
    preal y = max(max(low.y - q.y, q.y - high.y), preal(0));
    preal z = max(max(low.z - q.z, q.z - high.z), preal(0));
    return x * x + y * y + z * z;
}

// Closest point of the elements under nodes begin..end-1, of equally near ones the first; hint: one of them, the
// closer the better. A search ends after 2000 nodes with the best so far, since Mesa's software device stops a
// shader that loops too long; near the surface it takes tens.
FN Foot closest_foot(Surface s, uint begin, uint end, uint hint, pvec3 q) {
    Foot best = element_foot(s, hint, q);
    uint node = begin;
    for (uint visit = 0u; visit < 2000u && node < end; ++visit) {
        uint next = s.link.at[2u * node];
        if (box_distance2(s, node, q) * preal(0.99999) <= best.distance2) {
            uint leaf = s.link.at[2u * node + 1u];
            next = node + 1u;
            if (leaf > 0u) {
                Foot f = element_foot(s, leaf - 1u, q);
                if (f.distance2 < best.distance2 ||
                    (f.distance2 == best.distance2 && f.element < best.element))
                    best = f;
            }
        }
        node = next;
    }
    return best;
}

// Unit normal of a patch or tangent of a curve at a foot, continuous over it; not a unit vector on a corner.
FN rvec3 foot_direction(Surface s, Foot f) {
    uint k = 6u * f.element + 3u;
    pvec3 sum = s.element.at[k] * (preal(1) - f.w1 - f.w2) + s.element.at[k + 1u] * f.w1 +
                s.element.at[k + 2u] * f.w2;
    rvec3 d = narrow(sum);
    real length2 = dot(d, d);
    if (!(length2 > real(0))) return narrow(s.element.at[k]);
    return d * divide(real(1), sqrt(length2));
}

// A boundary vertex that moves: slide[6 i ..] = {dof, vertex, freedom, first node, end node, hint}.
// Freedom: 0 anywhere (near the surface), 1 in the tangent plane, 2 along the tangent, 3 nowhere.
struct Slider {
    uint dof, vertex, freedom, begin, end, hint;
};

FN Slider load_slider(IndexArray slide, uint entry) {
    uint k = 6u * entry;
    Slider s;
    s.dof = slide.at[k];
    s.vertex = slide.at[k + 1u];
    s.freedom = slide.at[k + 2u];
    s.begin = slide.at[k + 3u];
    s.end = slide.at[k + 4u];
    s.hint = slide.at[k + 5u];
    return s;
}

FN Foot slider_foot(Surface surface, Slider s, pvec3 q) {
    return closest_foot(surface, s.begin, s.end, s.hint, q);
}

FN rvec3 restrict_vector(uint freedom, rvec3 n, rvec3 v) {
    if (freedom == 1u) return v - n * dot(n, v);
    if (freedom == 2u) return n * dot(n, v);
    if (freedom == 3u) return rzero();
    return v;
}

// The block on what a vertex may do, and a multiple of the identity on the rest, so that it stays invertible.
FN Sym3 restrict_block(uint freedom, rvec3 n, Sym3 m) {
    if (freedom == 0u) return m;
    real size = max(trace(m), real(1.0e-30));
    if (freedom == 3u) return add_identity(sym_zero(), size);
    rvec3 mn = times(m, n);
    real nmn = dot(n, mn);
    if (freedom == 2u) return add_identity(outer(n, nmn - size), size);
    return add_outer(add_outer(m, n, mn, real(-2)), n, n, nmn + size);
}

// What holds a vertex within its range: an energy that is 0 up to 0.8 of it and `weight` at its end.
struct Limit {
    real energy;
    rvec3 gradient;
    Sym3 hessian;
};

FN Limit range_limit(rvec3 offset, real range, real weight) {
    real size = sqrt(dot(offset, offset));
    real slack = real(0.8) * range;
    Limit l;
    l.energy = real(0);
    l.gradient = rzero();
    l.hessian = sym_zero();
    if (!(size > slack)) return l;
    real width = max(real(0.2) * range, real(1.0e-3) * size);
    real s = divide(size - slack, width);
    rvec3 u = offset * divide(real(1), size);
    l.energy = weight * s * s;
    l.gradient = u * divide(weight * real(2) * s, width);
    l.hessian = outer(u, divide(weight * real(2), width * width));
    return l;
}

// limits[2 i]: where slider i began; limits[2 i + 1].x: how far it may go from there, .y: and off the surface.
FN Limit slider_limit(PointArray limits, uint entry, uint freedom, pvec3 at, pvec3 foot, real weight) {
    pvec3 range = limits.at[2u * entry + 1u];
    Limit l = range_limit(narrow(foot - limits.at[2u * entry]), real(range.x), weight);
    if (freedom > 0u) return l;
    Limit off = range_limit(narrow(at - foot), real(range.y), weight);
    l.energy = l.energy + off.energy;
    l.gradient = l.gradient + off.gradient;
    l.hessian = add_scaled(l.hessian, off.hessian, real(1));
    return l;
}
