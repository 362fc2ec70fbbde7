#include "samples/perturb.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 4096;

bool is_tangled(const HexMesh& mesh, const Cell& cell) {
    std::array<Point, 12> edge;
    for (int e = 0; e < 12; ++e)
        edge[e] = mesh.positions[cell[hex::kEdgeVertex[e][1]]] - mesh.positions[cell[hex::kEdgeVertex[e][0]]];
    for (const auto& tet : hex::kTetEdge)
        if (!(glm::dot(edge[tet[0]], glm::cross(edge[tet[1]], edge[tet[2]])) > 0)) return true;
    return false;
}

bool is_inner_free(const Topology& topology, std::size_t v) {
    return !topology.on_boundary[v] && !topology.vertex_cell[v].empty() &&
           (topology.hanging_row.empty() || topology.hanging_row[v] == kNoIndex);
}

/// Mean length of the edges at a vertex.
double local_edge(const HexMesh& mesh, const Topology& topology, std::size_t v) {
    double sum = 0;
    std::size_t count = 0;
    for (CellCorner at : topology.vertex_cell[v])
        for (const auto& edge : hex::kEdgeVertex) {
            if (edge[0] != at.corner && edge[1] != at.corner) continue;
            const Cell& cell = mesh.cells[at.cell];
            sum += glm::distance(mesh.positions[cell[edge[0]]], mesh.positions[cell[edge[1]]]);
            ++count;
        }
    return count ? sum / static_cast<double>(count) : 0;
}

Point random_direction(Random& random) {
    return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

/// Displacement of every vertex at amplitude 1; zero for those that stay.
std::vector<Point> random_displacements(const HexMesh& mesh, const Topology& topology, std::uint64_t seed,
                                        const Parallel& parallel) {
    std::vector<Point> displacement(mesh.vertex_count(), Point(0));
    parallel.for_each(mesh.vertex_count(), kChunk, [&](std::size_t v) {
        if (!is_inner_free(topology, v)) return;
        Random random(seed, v);
        displacement[v] = random_direction(random) * local_edge(mesh, topology, v);
    });
    return displacement;
}

/// Moves the mesh's vertices to base + scale(v) * displacement, then the hanging ones, and counts.
template <class Scale>
std::size_t displace(HexMesh& mesh, const std::vector<Point>& base, const std::vector<Point>& displacement,
                     const Scale& scale, const Parallel& parallel) {
    parallel.for_each(mesh.vertex_count(), kChunk,
                      [&](std::size_t v) { mesh.positions[v] = base[v] + scale(v) * displacement[v]; });
    apply_hanging(mesh, parallel);
    return count_tangled(mesh, parallel);
}

/// Order in which vertices join the spots, as a number in 0..1 of every vertex. Each vertex draws a random
/// rank and takes the lowest one among the vertices of its cells, so that vertices of low rank come in
/// neighbourhoods.
std::vector<double> spot_order(const HexMesh& mesh, const Topology& topology, std::uint64_t seed) {
    struct Ranked {
        std::uint64_t spot, own;
        std::size_t vertex;
        auto operator<=>(const Ranked&) const = default;
    };
    const auto draw = [&](std::size_t v) { return Random(seed ^ 0x5b07, v).next(); };
    std::vector<Ranked> ranked;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        if (!is_inner_free(topology, v)) continue;
        Ranked rank{draw(v), draw(v), v};
        for (CellCorner at : topology.vertex_cell[v])
            for (Index other : mesh.cells[at.cell])
                if (is_inner_free(topology, other)) rank.spot = std::min(rank.spot, draw(other));
        ranked.push_back(rank);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<double> order(mesh.vertex_count(), 1);
    for (std::size_t i = 0; i < ranked.size(); ++i)
        order[ranked[i].vertex] = static_cast<double>(i) / static_cast<double>(ranked.size());
    return order;
}

} // namespace

std::size_t count_tangled(const HexMesh& mesh, const Parallel& parallel) {
    return parallel.reduce(
        mesh.cell_count(), kChunk, std::size_t{0},
        [&](std::size_t begin, std::size_t end) {
            std::size_t count = 0;
            for (std::size_t c = begin; c < end; ++c) count += is_tangled(mesh, mesh.cells[c]);
            return count;
        },
        std::plus<>());
}

Result<double> perturb(HexMesh& mesh, const Topology& topology, const PerturbOptions& options,
                       const Parallel& parallel) {
    const double cells = static_cast<double>(mesh.cell_count());
    const double wanted = options.tangled_fraction * cells;
    if (!(options.tangled_fraction >= 0 && options.tangled_fraction <= 0.9))
        return make_error(ErrorCode::usage, "sample", "", "the tangled fraction must lie in 0..0.9");
    const std::vector<Point> base = mesh.positions;
    const auto displacement = random_displacements(mesh, topology, options.seed, parallel);
    const bool in_spots = options.pattern == PerturbPattern::spots;
    const auto order = in_spots ? spot_order(mesh, topology, options.seed) : std::vector<double>{};
    const auto count_at = [&](double x) {
        if (in_spots)
            return displace(
                mesh, base, displacement, [&](std::size_t v) { return order[v] < x ? 1.5 : 0.0; }, parallel);
        return displace(
            mesh, base, displacement, [&](std::size_t) { return x; }, parallel);
    };
    double low = 0, high = in_spots ? 1 : 4, best = 0;
    double best_miss = std::abs(static_cast<double>(count_at(0)) - wanted);
    for (int step = 0; step < 40 && best_miss > 0.02 * wanted; ++step) {
        const double middle = step == 0 ? high : (low + high) / 2;
        const double miss = static_cast<double>(count_at(middle)) - wanted;
        if (std::abs(miss) < best_miss) best_miss = std::abs(miss), best = middle;
        (miss < 0 ? low : high) = middle;
        if (step == 0 && miss < 0) break;
    }
    if (best_miss > 0.1 * wanted + std::min(2.0, wanted / 2)) {
        mesh.positions = base;
        return make_error(ErrorCode::usage, "sample", "",
                          "the mesh cannot be tangled to the wanted fraction by moving its inner vertices");
    }
    return static_cast<double>(count_at(best)) / cells;
}

void scramble(HexMesh& mesh, const Topology& topology, std::uint64_t seed, const Parallel& parallel) {
    Point low(HUGE_VAL), high(-HUGE_VAL);
    for (const Point& p : mesh.positions) low = glm::min(low, p), high = glm::max(high, p);
    parallel.for_each(mesh.vertex_count(), kChunk, [&](std::size_t v) {
        if (!is_inner_free(topology, v)) return;
        Random random(seed, v);
        const double x = random.uniform(low.x, high.x), y = random.uniform(low.y, high.y);
        mesh.positions[v] = Point(x, y, random.uniform(low.z, high.z));
    });
    apply_hanging(mesh, parallel);
}

} // namespace hexopt
