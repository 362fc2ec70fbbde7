#include "stages/optimize/infeasible.hpp"

#include "mesh/hex_reference.hpp"
#include "stages/optimize/infeasible_exact.hpp"
#include "stages/optimize/lp_kernel.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>

namespace hexopt {

namespace {

/// One tetrahedron as a function of the only movable vertex that it depends on.
struct LoneTet {
    Index cell;
    std::array<Point, 3> from, to;
    std::array<double, 3> slope;

    HalfSpace half_space() const {
        HalfSpace h{Point(0), 0};
        std::array<Point, 3> edge;
        for (int e = 0; e < 3; ++e) edge[e] = to[e] - from[e];
        for (int e = 0; e < 3; ++e) h.normal += slope[e] * glm::cross(edge[(e + 1) % 3], edge[(e + 2) % 3]);
        h.offset = glm::dot(edge[0], glm::cross(edge[1], edge[2]));
        return h;
    }
    ExactHalfSpace exact_half_space() const { return hexopt::exact_half_space(from, to, slope); }
};

class Prover {
  public:
    Prover(const HexMesh& mesh, const Topology& topology, std::span<const std::uint8_t> movable,
           std::uint32_t tets)
        : mesh_(mesh), topology_(topology), movable_(movable), tets_(tets), settled_(mesh.cell_count(), 0) {
        for (std::size_t row = 0; row < mesh.hanging.count(); ++row)
            for (std::size_t k = mesh.hanging.offset[row]; k < mesh.hanging.offset[row + 1]; ++k)
                if (movable[mesh.hanging.master[k]])
                    followers_[mesh.hanging.master[k]].push_back(mesh.hanging.vertex[row]);
    }

    Infeasibility run(std::span<const Index> suspects) {
        Infeasibility result;
        std::vector<Index> ordered(suspects.begin(), suspects.end());
        std::sort(ordered.begin(), ordered.end());
        for (Index c : ordered)
            if (has_fixed_bad_tet(c)) {
                result.cells.push_back(c);
                settled_[c] = 1;
            }
        std::vector<Index> candidates;
        for (Index c : ordered)
            if (!settled_[c]) collect_lone_vertices(c, candidates);
        std::sort(candidates.begin(), candidates.end());
        candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
        for (Index v : candidates)
            for (std::vector<Index> group; !(group = find_group(v)).empty();) {
                for (Index c : group) settled_[c] = 1;
                result.groups.item.insert(result.groups.item.end(), group.begin(), group.end());
                result.groups.offset.push_back(result.groups.item.size());
            }
        return result;
    }

  private:
    bool is_hanging(Index v) const {
        return !topology_.hanging_row.empty() && topology_.hanging_row[v] != kNoIndex;
    }

    /// How far vertex `at` moves when `vertex` moves by 1.
    double weight_of(Index vertex, Index at) const {
        if (at == vertex) return 1;
        if (!is_hanging(at)) return 0;
        const Index row = topology_.hanging_row[at];
        for (std::size_t k = mesh_.hanging.offset[row]; k < mesh_.hanging.offset[row + 1]; ++k)
            if (mesh_.hanging.master[k] == vertex) return mesh_.hanging.weight[k];
        return 0;
    }

    /// The movable vertices that a tetrahedron depends on: none, the one, or kMany.
    static constexpr Index kMany = kNoIndex - 1;
    Index lone_vertex(const Cell& cell, int tet) const {
        Index lone = kNoIndex;
        const auto add = [&](Index v) {
            if (movable_[v] && v != lone) lone = lone == kNoIndex ? v : kMany;
        };
        for (int e = 0; e < 3; ++e)
            for (int end = 0; end < 2; ++end) {
                const Index v = cell[hex::kEdgeVertex[hex::kTetEdge[tet][e]][end]];
                if (!is_hanging(v)) {
                    add(v);
                    continue;
                }
                const Index row = topology_.hanging_row[v];
                for (std::size_t k = mesh_.hanging.offset[row]; k < mesh_.hanging.offset[row + 1]; ++k)
                    add(mesh_.hanging.master[k]);
            }
        return lone;
    }

    LoneTet lone_tet(Index c, int tet, Index vertex) const {
        LoneTet lone{c, {}, {}, {}};
        for (int e = 0; e < 3; ++e) {
            const auto& edge = hex::kEdgeVertex[hex::kTetEdge[tet][e]];
            const Index from = mesh_.cells[c][edge[0]], to = mesh_.cells[c][edge[1]];
            lone.from[e] = mesh_.positions[from];
            lone.to[e] = mesh_.positions[to];
            if (vertex != kNoIndex) lone.slope[e] = weight_of(vertex, to) - weight_of(vertex, from);
        }
        return lone;
    }

    bool has_fixed_bad_tet(Index c) const {
        for (int t = 0; t < 32; ++t)
            if ((tets_ >> t & 1) && lone_vertex(mesh_.cells[c], t) == kNoIndex &&
                lone_tet(c, t, kNoIndex).exact_half_space().offset <= 0)
                return true;
        return false;
    }

    void collect_lone_vertices(Index c, std::vector<Index>& vertices) const {
        for (int t = 0; t < 32; ++t) {
            if (!(tets_ >> t & 1)) continue;
            if (const Index v = lone_vertex(mesh_.cells[c], t); v < kMany) vertices.push_back(v);
        }
    }

    std::vector<Index> ball(Index vertex) const {
        std::vector<Index> cells;
        const auto add = [&](Index v) {
            for (CellCorner corner : topology_.vertex_cell[v]) cells.push_back(corner.cell);
        };
        add(vertex);
        if (const auto found = followers_.find(vertex); found != followers_.end())
            for (Index v : found->second) add(v);
        std::sort(cells.begin(), cells.end());
        cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
        return cells;
    }

    /// Cells of which one must be bad wherever `vertex` goes; empty if that cannot be shown.
    std::vector<Index> find_group(Index vertex) const {
        std::vector<LoneTet> tets;
        for (Index c : ball(vertex)) {
            if (settled_[c]) continue;
            for (int t = 0; t < 32; ++t)
                if ((tets_ >> t & 1) && lone_vertex(mesh_.cells[c], t) == vertex)
                    tets.push_back(lone_tet(c, t, vertex));
        }
        std::vector<ExactHalfSpace> exact;
        std::vector<Index> cell;
        for (const LoneTet& tet : critical(tets)) {
            exact.push_back(tet.exact_half_space());
            cell.push_back(tet.cell);
        }
        const std::vector<Exact> proof = find_emptiness_proof(exact);
        std::vector<Index> group;
        for (std::size_t k = 0; k < proof.size(); ++k)
            if (proof[k] > 0) group.push_back(cell[k]);
        std::sort(group.begin(), group.end());
        group.erase(std::unique(group.begin(), group.end()), group.end());
        return group;
    }

    /// The tetrahedra that stand in the way of the deepest point, found in floating point; none where it lies
    /// clearly inside all.
    static std::vector<LoneTet> critical(const std::vector<LoneTet>& tets) {
        if (tets.empty()) return {};
        double size = 0;
        for (const LoneTet& tet : tets)
            for (int e = 0; e < 3; ++e) size = std::max(size, glm::distance(tet.from[e], tet.to[e]));
        std::vector<HalfSpace> planes;
        for (const LoneTet& tet : tets) planes.push_back(tet.half_space());
        const double tiny = 1e-13 * size * size, reach = 1e3 * size;
        const auto unit = normalised(planes, tiny);
        const DeepestPoint deepest = find_deepest_point(unit, {Point(-reach), Point(reach)}, 1);
        if (unit.size() == planes.size() && deepest.depth > 1e-9 * size) return {};
        std::vector<LoneTet> kept;
        for (std::size_t k = 0; k < tets.size(); ++k) {
            const double length = glm::length(planes[k].normal);
            if (!(length > tiny) || (glm::dot(planes[k].normal, deepest.point) + planes[k].offset) / length <
                                        deepest.depth + 1e-6 * size)
                kept.push_back(tets[k]);
        }
        return kept;
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    std::span<const std::uint8_t> movable_;
    std::uint32_t tets_;
    std::vector<std::uint8_t> settled_; ///< cells already counted
    std::map<Index, std::vector<Index>> followers_;
};

} // namespace

Infeasibility prove_infeasible(const HexMesh& mesh, const Topology& topology,
                               std::span<const std::uint8_t> movable, std::span<const Index> suspects,
                               std::uint32_t tets) {
    return Prover(mesh, topology, movable, tets).run(suspects);
}

} // namespace hexopt
