#include "stages/optimize/local_energy.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

/// Enough to even out a scrambled interior, few enough to keep the grading of the mesh.
constexpr int kSmoothingPasses = 3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Energy of one tetrahedron and its derivatives by S, J and I2.
struct Density {
    double value, by_s, by_j, by_i2;
};

Density density(const LocalEnergy& energy, double s, double j, double i2) {
    switch (energy.kind) {
    case Energy::structural: {
        if (!(j > 0)) return {kInfinity, 0, 0, 0};
        const double inverse = 1 / (j * j * j);
        return {s * inverse, inverse, -3 * s * inverse / j, 0};
    }
    case Energy::shape: {
        if (!(j > 0)) return {kInfinity, 0, 0, 0};
        const double h = 1 / (3 * std::cbrt(j * j));
        return {s * h, h, -2.0 / 3 * s * h / j, 0};
    }
    case Energy::hyperelastic:
        return {s + i2 - 6 * j + (j - 1) * (j - 1), 1, 2 * j - 8, 1};
    case Energy::automatic: // resolved by the method
    case Energy::regularised:
        break;
    }
    const double root = std::hypot(j, energy.eps);
    const double chi = j > 0 ? 0.5 * (j + root) : 0.5 * energy.eps * energy.eps / (root - j);
    const double h = 1 / (3 * std::cbrt(chi * chi));
    return {s * h, h, -2.0 / 3 * s * h / root, 0}; // chi' = chi / root
}

/// A quadratic in the step t along a line.
struct Quadratic {
    double constant = 0, linear = 0, square = 0;
    double at(double t) const { return constant + t * (linear + t * square); }
    double slope_at(double t) const { return linear + 2 * t * square; }
};

/// One tetrahedron along a line.
struct LineTet {
    Quadratic s, i2;
    double j, j_slope, weight;
};

LineTet restrict_to_line(const BallTet& tet, const Point& direction, bool needs_i2) {
    LineTet line{{}, {}, tet.jacobian, glm::dot(tet.jacobian_slope, direction), tet.weight};
    for (int i = 0; i < 3; ++i) {
        const Point move = tet.slope[i] * direction;
        line.s.constant += glm::dot(tet.edge[i], tet.edge[i]);
        line.s.linear += 2 * glm::dot(tet.edge[i], move);
        line.s.square += glm::dot(move, move);
    }
    for (int i = 0; needs_i2 && i < 3; ++i) {
        const int k = (i + 1) % 3;
        const Point area = glm::cross(tet.edge[i], tet.edge[k]);
        const Point move = glm::cross(direction, tet.slope[i] * tet.edge[k] - tet.slope[k] * tet.edge[i]);
        line.i2.constant += glm::dot(area, area);
        line.i2.linear += 2 * glm::dot(area, move);
        line.i2.square += glm::dot(move, move);
    }
    return line;
}

class Line {
  public:
    Line(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& direction) : energy_(energy) {
        tets_.reserve(tets.size());
        for (const BallTet& tet : tets)
            tets_.push_back(restrict_to_line(tet, direction, energy.kind == Energy::hyperelastic));
    }

    double value(double t) const {
        double sum = 0;
        for (const LineTet& tet : tets_)
            sum += tet.weight * density(energy_, tet.s.at(t), tet.j + t * tet.j_slope, tet.i2.at(t)).value;
        return sum;
    }
    double slope(double t) const {
        double sum = 0;
        for (const LineTet& tet : tets_) {
            const Density d = density(energy_, tet.s.at(t), tet.j + t * tet.j_slope, tet.i2.at(t));
            sum += tet.weight *
                   (d.by_s * tet.s.slope_at(t) + d.by_j * tet.j_slope + d.by_i2 * tet.i2.slope_at(t));
        }
        return sum;
    }
    /// First step at which a positive tetrahedron becomes flat.
    double first_flat() const {
        double first = kInfinity;
        for (const LineTet& tet : tets_)
            if (tet.j > 0 && tet.j_slope < 0) first = std::min(first, -tet.j / tet.j_slope);
        return first;
    }

  private:
    LocalEnergy energy_;
    std::vector<LineTet> tets_;
};

/// Root of the slope between 0, where it is negative, and high, where it is not: false position (Illinois).
double find_root(const Line& line, double slope_at_0, double high, double slope_at_high) {
    double low = 0, at_low = slope_at_0, at_high = slope_at_high;
    double t = 0.5 * high;
    for (int i = 0; i < 30 && high - low > 1e-4 * high; ++i) {
        const double at_t = line.slope(t);
        if (at_t < 0) {
            low = t;
            at_low = at_t;
            at_high *= 0.5;
        } else {
            high = t;
            at_high = at_t;
            at_low *= 0.5;
        }
        t = (low * at_high - high * at_low) / (at_high - at_low);
        // Near a barrier the slope explodes and false position creeps: halve every third time.
        if (i % 3 == 2 || !(t > low && t < high)) t = 0.5 * (low + high);
    }
    return t;
}

} // namespace

CellTargets measure_targets(const HexMesh& mesh, const Topology& topology, std::span<const Point> positions,
                            const Parallel& parallel) {
    static constexpr std::size_t kChunk = 4096;
    CellTargets targets;
    targets.length.resize(mesh.cell_count());
    parallel.for_each(mesh.cell_count(), kChunk, [&](std::size_t c) {
        double sum = 0;
        for (const auto& edge : hex::kEdgeVertex)
            sum += glm::distance(positions[mesh.cells[c][edge[0]]], positions[mesh.cells[c][edge[1]]]);
        targets.length[c] = sum / 12;
    });
    std::vector<double> at_vertex(mesh.vertex_count());
    for (int pass = 0; pass < kSmoothingPasses; ++pass) {
        parallel.for_each(mesh.vertex_count(), kChunk, [&](std::size_t v) {
            const auto corners = topology.vertex_cell[v];
            double sum = 0;
            for (CellCorner corner : corners) sum += targets.length[corner.cell];
            at_vertex[v] = corners.empty() ? 0 : sum / static_cast<double>(corners.size());
        });
        parallel.for_each(mesh.cell_count(), kChunk, [&](std::size_t c) {
            double sum = 0;
            for (Index v : mesh.cells[c]) sum += at_vertex[v];
            targets.length[c] = sum / 8;
        });
    }
    const double total = parallel.reduce(
        mesh.cell_count(), kChunk, 0.0,
        [&](std::size_t begin, std::size_t end) {
            return std::accumulate(&targets.length[begin], targets.length.data() + end, 0.0);
        },
        std::plus<>());
    const double floor = 1e-3 * total / static_cast<double>(std::max<std::size_t>(1, mesh.cell_count()));
    targets.weight.assign(mesh.cell_count(), 1);
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
        targets.length[c] = std::max(targets.length[c], floor);
        if (!mesh.hanging.empty() && !mesh.level.empty())
            targets.weight[c] = std::ldexp(1.0, -2 * static_cast<int>(mesh.level[c]));
    }
    return targets;
}

void Ball::gather(const HexMesh& mesh, std::span<const Point> positions, const Stencils& stencils,
                  const CellTargets& targets, Index vertex, std::uint32_t tets) {
    tets_.clear();
    const Point& here = positions[vertex];
    box_ = {Point(0), Point(0)};
    double total = 0;
    const auto ball = stencils.ball(vertex);
    for (BallEntry entry : ball) {
        const Cell& cell = mesh.cells[entry.cell];
        const CornerWeights& weights = stencils.weights(entry);
        for (Index v : cell) {
            box_.low = glm::min(box_.low, positions[v] - here);
            box_.high = glm::max(box_.high, positions[v] - here);
        }
        const double inverse = 1 / targets.length[entry.cell];
        total += targets.length[entry.cell];
        std::array<Point, 12> edge;
        std::array<double, 12> slope;
        for (int e = 0; e < 12; ++e) {
            const int from = hex::kEdgeVertex[e][0], to = hex::kEdgeVertex[e][1];
            edge[e] = (positions[cell[to]] - positions[cell[from]]) * inverse;
            slope[e] = (weights[to] - weights[from]) * inverse;
        }
        for (int t = 0; t < 32; ++t) {
            if (!(tets >> t & 1)) continue;
            const auto [a, b, c] = hex::kTetEdge[t];
            if (slope[a] == 0 && slope[b] == 0 && slope[c] == 0) continue;
            const Point bc = glm::cross(edge[b], edge[c]);
            tets_.push_back({{edge[a], edge[b], edge[c]},
                             {slope[a], slope[b], slope[c]},
                             glm::dot(edge[a], bc),
                             slope[a] * bc + slope[b] * glm::cross(edge[c], edge[a]) +
                                 slope[c] * glm::cross(edge[a], edge[b]),
                             targets.weight[entry.cell]});
        }
    }
    mean_length_ = ball.empty() ? 0 : total / static_cast<double>(ball.size());
}

bool Ball::is_tangled() const {
    return std::any_of(tets_.begin(), tets_.end(), [](const BallTet& t) { return !(t.jacobian > 0); });
}

std::vector<HalfSpace> Ball::half_spaces() const {
    std::vector<HalfSpace> planes;
    planes.reserve(tets_.size());
    for (const BallTet& tet : tets_) planes.push_back({tet.jacobian_slope, tet.jacobian});
    return normalised(planes, 1e-13 / std::max(mean_length_, 1e-300));
}

double Ball::quality(const Point& d) const {
    double least = 1;
    for (const BallTet& tet : tets_) {
        double product = 1;
        for (int i = 0; i < 3; ++i) product *= glm::length(tet.edge[i] + tet.slope[i] * d);
        const double jacobian = tet.jacobian + glm::dot(tet.jacobian_slope, d);
        least = std::min(least, product > 0 ? jacobian / product : -1);
    }
    return least;
}

double evaluate_energy(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& d) {
    double sum = 0;
    for (const BallTet& tet : tets) {
        std::array<Point, 3> e;
        for (int i = 0; i < 3; ++i) e[i] = tet.edge[i] + tet.slope[i] * d;
        double s = 0, i2 = 0;
        for (int i = 0; i < 3; ++i) s += glm::dot(e[i], e[i]);
        if (energy.kind == Energy::hyperelastic)
            for (int i = 0; i < 3; ++i) {
                const Point area = glm::cross(e[i], e[(i + 1) % 3]);
                i2 += glm::dot(area, area);
            }
        sum += tet.weight * density(energy, s, tet.jacobian + glm::dot(tet.jacobian_slope, d), i2).value;
    }
    return sum;
}

Point evaluate_gradient(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& d) {
    Point sum(0);
    for (const BallTet& tet : tets) {
        std::array<Point, 3> e;
        double s = 0, i2 = 0;
        Point s_slope(0), i2_slope(0);
        for (int i = 0; i < 3; ++i) {
            e[i] = tet.edge[i] + tet.slope[i] * d;
            s += glm::dot(e[i], e[i]);
            s_slope += 2 * tet.slope[i] * e[i];
        }
        for (int i = 0; energy.kind == Energy::hyperelastic && i < 3; ++i) {
            const int k = (i + 1) % 3;
            const Point area = glm::cross(e[i], e[k]);
            i2 += glm::dot(area, area);
            i2_slope += 2.0 * glm::cross(tet.slope[i] * e[k] - tet.slope[k] * e[i], area);
        }
        const Density at = density(energy, s, tet.jacobian + glm::dot(tet.jacobian_slope, d), i2);
        sum += tet.weight * (at.by_s * s_slope + at.by_j * tet.jacobian_slope + at.by_i2 * i2_slope);
    }
    return sum;
}

Point difference_gradient(std::span<const BallTet> tets, const LocalEnergy& energy, double step) {
    const double here = evaluate_energy(tets, energy, Point(0));
    Point gradient;
    for (int i = 0; i < 3; ++i) {
        Point d(0);
        d[i] = step;
        gradient[i] = (evaluate_energy(tets, energy, d) - here) / step;
    }
    return gradient;
}

double minimise_on_line(std::span<const BallTet> tets, const LocalEnergy& energy, const Point& direction,
                        double limit) {
    const Line line(tets, energy, direction);
    const double slope = line.slope(0);
    if (!(slope < 0)) return 0;
    double high = limit;
    if (has_barrier(energy.kind)) high = std::min(high, 0.99 * line.first_flat());
    const double at_high = line.slope(high);
    double t = at_high >= 0 ? find_root(line, slope, high, at_high) : high;
    const double before = line.value(0);
    for (int i = 0; i < 12; ++i, t *= 0.5)
        if (line.value(t) < before) return t;
    return 0;
}

} // namespace hexopt
