#include "stages/planar/quad_motion.hpp"

#include "mesh/hanging.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

double cross(const Point2& a, const Point2& b) { return a.x * b.y - a.y * b.x; }

/// Rows from pairs (row, item) in any order; items of a row rising, each once.
Csr<Index> make_rows(std::vector<std::array<Index, 2>> pairs, std::size_t rows) {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    Csr<Index> made;
    made.offset.assign(rows + 1, 0);
    for (const auto& [row, item] : pairs) {
        ++made.offset[row + 1];
        made.item.push_back(item);
    }
    for (std::size_t r = 0; r < rows; ++r) made.offset[r + 1] += made.offset[r];
    return made;
}

} // namespace

QuadMotion::QuadMotion(QuadMesh& mesh, const OutlineCurves& curves) : mesh_(mesh), curves_(curves) {
    const std::size_t n = mesh.positions.size();
    row_.assign(n, kNoIndex);
    std::vector<std::array<Index, 2>> depends;
    const Hanging& rows = mesh.hanging;
    for (Index r = 0; r < rows.count(); ++r) {
        row_[rows.vertex[r]] = r;
        for (std::size_t k = rows.offset[r]; k < rows.offset[r + 1]; ++k)
            depends.push_back({rows.master[k], r});
    }
    hanging_on_ = make_rows(std::move(depends), n);
    beside_.assign(n, {kNoIndex, kNoIndex});
    for (const QuadMesh::WallEdge& edge : mesh.wall) {
        beside_[edge.a][1] = edge.b;
        beside_[edge.b][0] = edge.a;
    }
    find_quads();
    movable_.assign(n, 0);
    for (Index v = 0; v < n; ++v)
        movable_[v] = row_[v] == kNoIndex && !mesh.place[v].is_corner && !quads(v).empty();
    find_colours();
}

void QuadMotion::find_quads() {
    std::vector<std::array<Index, 2>> pairs;
    pairs.reserve(5 * mesh_.quads.size());
    for (Index q = 0; q < mesh_.quads.size(); ++q)
        for (Index v : mesh_.quads[q]) {
            pairs.push_back({v, q});
            if (const Index r = row_[v]; r != kNoIndex)
                for (std::size_t k = mesh_.hanging.offset[r]; k < mesh_.hanging.offset[r + 1]; ++k)
                    pairs.push_back({mesh_.hanging.master[k], q});
        }
    vertex_quad_ = make_rows(std::move(pairs), mesh_.positions.size());
}

void QuadMotion::find_colours() {
    std::vector<Index> colour(mesh_.positions.size(), kNoIndex);
    std::vector<std::array<Index, 2>> pairs;
    std::vector<Index> taken; // by colour: the last vertex that may not have it
    const auto take = [&](Index u, Index v) {
        if (colour[u] == kNoIndex) return;
        taken[colour[u]] = v;
    };
    for (Index v = 0; v < colour.size(); ++v) {
        if (!movable_[v]) continue;
        for (Index q : quads(v))
            for (Index u : mesh_.quads[q]) {
                take(u, v);
                if (const Index r = row_[u]; r != kNoIndex)
                    for (std::size_t k = mesh_.hanging.offset[r]; k < mesh_.hanging.offset[r + 1]; ++k)
                        take(mesh_.hanging.master[k], v);
            }
        Index c = 0;
        while (c < taken.size() && taken[c] == v) ++c;
        if (c == taken.size()) taken.push_back(kNoIndex);
        colour[v] = c;
        pairs.push_back({c, v});
    }
    colours_ = make_rows(std::move(pairs), taken.size());
}

double QuadMotion::weight(Index v, Index of) const {
    if (v == of) return 1;
    const Index r = row_[of];
    if (r == kNoIndex) return 0;
    for (std::size_t k = mesh_.hanging.offset[r]; k < mesh_.hanging.offset[r + 1]; ++k)
        if (mesh_.hanging.master[k] == v) return mesh_.hanging.weight[k];
    return 0;
}

std::array<double, 4> QuadMotion::weights(Index v, const Quad& quad) const {
    return {weight(v, quad[0]), weight(v, quad[1]), weight(v, quad[2]), weight(v, quad[3])};
}

double QuadMotion::smallest_determinant(const Parallel& parallel) const {
    return parallel.reduce<double>(
        mesh_.quads.size(), 1024, 1e300,
        [&](std::size_t begin, std::size_t end) {
            double least = 1e300;
            for (std::size_t i = begin; i < end; ++i) {
                const Quad& q = mesh_.quads[i];
                for (int k = 0; k < 4; ++k) {
                    const Point2 p = mesh_.positions[q[k]];
                    const double d =
                        cross(mesh_.positions[q[(k + 1) % 4]] - p, mesh_.positions[q[(k + 3) % 4]] - p);
                    least = std::min(least, d / (mesh_.size[i] * mesh_.size[i]));
                }
            }
            return least;
        },
        [](double a, double b) { return std::min(a, b); });
}

/// With e and f the edges at a corner and A the cell's area: ((e.e + f.f) / 2A / chi(e x f / A))^p. A vertex
/// that moves by d moves the edges by multiples of d, so that the determinant is affine in d.
void QuadMotion::add_quad(Index v, Index quad, const QuadEnergy& energy, Derivatives& sum) const {
    const Quad& q = mesh_.quads[quad];
    const auto w = weights(v, q);
    const double area = mesh_.size[quad] * mesh_.size[quad];
    for (int k = 0; k < 4; ++k) {
        const int next = (k + 1) % 4, before = (k + 3) % 4;
        const double a = w[next] - w[k], b = w[before] - w[k];
        if (a == 0 && b == 0) continue;
        const Point2 e = mesh_.positions[q[next]] - mesh_.positions[q[k]];
        const Point2 f = mesh_.positions[q[before]] - mesh_.positions[q[k]];
        const double det = cross(e, f) / area, trace = (glm::dot(e, e) + glm::dot(f, f)) / (2 * area);
        const double root = std::sqrt(energy.epsilon * energy.epsilon + det * det);
        const double chi = det >= 0 ? 0.5 * (det + root)
                                    : 0.5 * energy.epsilon * energy.epsilon / (root - det); // no cancellation
        const double first = chi / root, second = energy.epsilon * energy.epsilon / (2 * root * root * root);
        const Point2 dt = (a * e + b * f) / area;
        const Point2 dd = Point2(a * f.y - b * e.y, b * e.x - a * f.x) / area;
        const double shape = trace / chi;
        const Point2 ds = (dt - shape * first * dd) / chi;
        // Second derivatives of trace / chi: I t2 - mixed (dt dd' + dd dt') + inner dd dd'.
        const double t2 = (a * a + b * b) / area / chi;
        const double mixed = first / (chi * chi);
        const double inner = shape * (2 * first * first / (chi * chi) - second / chi);
        double outer1 = energy.power; // first and second derivative of shape^p
        for (int i = 1; i < energy.power; ++i) outer1 *= shape;
        const double outer2 = outer1 * (energy.power - 1) / shape;
        sum.value += outer1 * shape / energy.power;
        sum.gradient += outer1 * ds;
        const auto curve = [&](double di, double dj, double ti, double tj, double si, double sj,
                               double same) {
            return outer1 * (same * t2 - mixed * (ti * dj + di * tj) + inner * di * dj) + outer2 * si * sj;
        };
        sum.xx += curve(dd.x, dd.x, dt.x, dt.x, ds.x, ds.x, 1);
        sum.xy += curve(dd.x, dd.y, dt.x, dt.y, ds.x, ds.y, 0);
        sum.yy += curve(dd.y, dd.y, dt.y, dt.y, ds.y, ds.y, 1);
    }
}

double QuadMotion::value(Index v, const QuadEnergy& energy) const {
    Derivatives sum;
    for (Index q : quads(v)) add_quad(v, q, energy, sum);
    return sum.value;
}

double QuadMotion::least_scaled_jacobian(Index v) const {
    double least = 1;
    for (Index i : quads(v)) {
        const Quad& q = mesh_.quads[i];
        for (int k = 0; k < 4; ++k) {
            const Point2 p = mesh_.positions[q[k]];
            const Point2 e = mesh_.positions[q[(k + 1) % 4]] - p, f = mesh_.positions[q[(k + 3) % 4]] - p;
            const double lengths = std::sqrt(glm::dot(e, e) * glm::dot(f, f));
            least = std::min(least, lengths > 0 ? cross(e, f) / lengths : -1);
        }
    }
    return least;
}

void QuadMotion::place(Index v, const Point2& p) {
    mesh_.positions[v] = p;
    const Hanging& rows = mesh_.hanging;
    for (Index r : hanging_on_[v]) {
        Point2 sum(0);
        for (std::size_t k = rows.offset[r]; k < rows.offset[r + 1]; ++k)
            sum += rows.weight[k] * mesh_.positions[rows.master[k]];
        mesh_.positions[rows.vertex[r]] = sum;
    }
}

void QuadMotion::slide(Index v, double s) {
    mesh_.place[v].s = s;
    place(v, curves_.point(mesh_.place[v].loop, s));
}

double QuadMotion::clamp(Index v, double s) const {
    constexpr double kShare = 0.8; // of the way to a neighbour
    const QuadMesh::Place& here = mesh_.place[v];
    const double length = curves_.length(here.loop);
    const auto gap = [length](double from, double to) {
        return to - from - std::floor((to - from) / length) * length;
    };
    return std::clamp(s, here.s - kShare * gap(mesh_.place[beside_[v][0]].s, here.s),
                      here.s + kShare * gap(here.s, mesh_.place[beside_[v][1]].s));
}

double QuadMotion::improve(Index v, const QuadEnergy& energy) {
    return mesh_.place[v].loop == kNoIndex ? improve_free(v, energy) : improve_sliding(v, energy);
}

double QuadMotion::improve_free(Index v, const QuadEnergy& energy) {
    Derivatives at;
    for (Index q : quads(v)) add_quad(v, q, energy, at);
    // The Hessian's eigenvalues are made positive.
    const double mean = 0.5 * (at.xx + at.yy), half = 0.5 * (at.xx - at.yy);
    const double radius = std::sqrt(half * half + at.xy * at.xy);
    const double h = cell_size(v), least = std::max(1e-3 * (std::abs(mean) + radius), 1e-12 / (h * h));
    const double high = std::max(std::abs(mean + radius), least),
                 low = std::max(std::abs(mean - radius), least);
    const double angle = 0.5 * std::atan2(at.xy, half);
    const Point2 axis(std::cos(angle), std::sin(angle)), other(-axis.y, axis.x);
    Point2 step = -(glm::dot(at.gradient, axis) / high) * axis - (glm::dot(at.gradient, other) / low) * other;
    const double length = glm::length(step);
    if (!(length > 1e-12 * h)) return 0;
    if (length > h) step *= h / length;
    const Point2 start = mesh_.positions[v];
    for (double t = 1; t > 0.01; t *= 0.4) {
        place(v, start + t * step);
        if (value(v, energy) < at.value) return t * glm::length(step) / h;
    }
    place(v, start);
    return 0;
}

double QuadMotion::improve_sliding(Index v, const QuadEnergy& energy) {
    Derivatives at;
    for (Index q : quads(v)) add_quad(v, q, energy, at);
    const QuadMesh::Place here = mesh_.place[v];
    const Point2 t = curves_.tangent(here.loop, here.s);
    const double slope = glm::dot(at.gradient, t), h = cell_size(v);
    const double bend = t.x * t.x * at.xx + 2 * t.x * t.y * at.xy + t.y * t.y * at.yy;
    const double curvature = std::max(std::abs(bend), 1e-12 / (h * h));
    const double step = std::clamp(-slope / curvature, -h, h);
    if (!(std::abs(step) > 1e-12 * h)) return 0;
    for (double share = 1; share > 0.01; share *= 0.4) {
        const double s = clamp(v, here.s + share * step);
        slide(v, s);
        if (value(v, energy) < at.value) return std::abs(s - here.s) / h;
        mesh_.place[v].s = here.s;
    }
    slide(v, here.s);
    return 0;
}

double QuadMotion::raise_worst(Index v) {
    constexpr double kGain = 1e-5;
    constexpr int kDirections = 8;
    const QuadMesh::Place here = mesh_.place[v];
    const Point2 start = mesh_.positions[v];
    const double h = cell_size(v);
    double best = least_scaled_jacobian(v) + kGain, best_s = here.s;
    Point2 best_point = start;
    for (double reach = 0.3; reach > 1e-3; reach *= 0.4)
        for (int k = 0; k < kDirections; ++k) {
            const double angle = 2 * std::numbers::pi * k / kDirections;
            double s = here.s;
            if (here.loop == kNoIndex) {
                place(v, start + reach * h * Point2(std::cos(angle), std::sin(angle)));
            } else {
                if (k > 1) break;
                s = clamp(v, here.s + (k == 0 ? reach : -reach) * h);
                slide(v, s);
            }
            const double reached = least_scaled_jacobian(v);
            if (reached > best) best = reached, best_point = mesh_.positions[v], best_s = s;
            mesh_.place[v].s = here.s;
        }
    mesh_.place[v].s = best_s;
    place(v, best_point);
    return glm::distance(best_point, start) / h;
}

} // namespace hexopt
