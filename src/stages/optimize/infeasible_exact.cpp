#include "stages/optimize/infeasible_exact.hpp"

#include "stages/optimize/lp_simplex.hpp"

namespace hexopt {

namespace {

using ExactVector = std::array<Exact, 3>;

ExactVector cross(const ExactVector& a, const ExactVector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

} // namespace

ExactHalfSpace exact_half_space(const std::array<Point, 3>& from, const std::array<Point, 3>& to,
                                const std::array<double, 3>& slope) {
    std::array<ExactVector, 3> edge;
    for (int e = 0; e < 3; ++e)
        for (int i = 0; i < 3; ++i) edge[e][i] = Exact(to[e][i]) - Exact(from[e][i]);
    ExactHalfSpace h{};
    for (int e = 0; e < 3; ++e) {
        const ExactVector area = cross(edge[(e + 1) % 3], edge[(e + 2) % 3]);
        for (int i = 0; i < 3; ++i) h.normal[i] += Exact(slope[e]) * area[i];
        if (e == 0)
            for (int i = 0; i < 3; ++i) h.offset += edge[0][i] * area[i];
    }
    return h;
}

bool proves_empty(std::span<const ExactHalfSpace> half_spaces, std::span<const Exact> multipliers) {
    if (multipliers.size() != half_spaces.size()) return false;
    ExactHalfSpace sum{};
    bool any = false;
    for (std::size_t k = 0; k < half_spaces.size(); ++k) {
        if (multipliers[k] < 0) return false;
        any = any || multipliers[k] > 0;
        for (int i = 0; i < 3; ++i) sum.normal[i] += multipliers[k] * half_spaces[k].normal[i];
        sum.offset += multipliers[k] * half_spaces[k].offset;
    }
    return any && sum.normal[0] == 0 && sum.normal[1] == 0 && sum.normal[2] == 0 && sum.offset <= 0;
}

std::vector<Exact> find_emptiness_proof(std::span<const ExactHalfSpace> half_spaces) {
    // Maximise t with t <= normal.d + offset and t <= 1. Variables y >= 0: d = (y0, y1, y2) - y3, t = y4 -
    // shift, the shift such that y = 0 is feasible.
    Exact shift = 0;
    for (const ExactHalfSpace& h : half_spaces)
        if (-h.offset > shift) shift = -h.offset;
    Simplex<Exact> simplex(5, Exact(0));
    for (const ExactHalfSpace& h : half_spaces)
        simplex.add_row(std::array<Exact, 5>{-h.normal[0], -h.normal[1], -h.normal[2],
                                             h.normal[0] + h.normal[1] + h.normal[2], 1},
                        h.offset + shift);
    simplex.add_row(std::array<Exact, 5>{0, 0, 0, 0, 1}, shift + 1);
    if (!simplex.find_feasible() || !simplex.maximise(std::array<Exact, 5>{0, 0, 0, 0, 1})) return {};
    if (simplex.value() > shift) return {};
    std::vector<Exact> multipliers = simplex.multipliers();
    multipliers.pop_back();
    if (!proves_empty(half_spaces, multipliers)) return {};
    return multipliers;
}

} // namespace hexopt
