#include "stages/optimize/retreat.hpp"

#include "mesh/hanging.hpp"
#include "stages/optimize/bring_home.hpp"
#include "stages/optimize/cell_search.hpp"
#include "stages/optimize/homecoming.hpp"
#include "stages/optimize/max_min.hpp"
#include "stages/optimize/untangle.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Rings of cells round what is bad that go back, in turn.
constexpr int kRings[] = {2, 4, 8, 16};
/// Rings over which places change from the unfitted to the fitted ones, and rings that move round these.
constexpr int kBlendRings = 3, kMovingRings = 2;
/// How firmly the boundary is held to its place while the layers are untangled: everywhere, and round what
/// stays bad.
constexpr double kPull = 10, kLoosePulls[] = {1, 0.1, 0.01};
constexpr int kLooseRings = 4;
constexpr int kUntangleRounds = 8;
/// Valid cells with a scaled Jacobian below this are let off the surface as bad ones are: sliding alone and
/// raising, which a barrier keeps from bad cells, do not get them out of there.
constexpr double kFlatSj = 0.01;
/// Times that quads in contact are pushed apart, each time by so much of their edge.
constexpr int kPartRounds = 6;
constexpr double kPartStep = 0.2;
/// Scaled Jacobian that is worth a vertex at home.
constexpr double kLeastSjHome = 0.05;
/// A little more than what counts as contact in the end.
constexpr ContactLimits kClearance{5e-3, 0.02};

class Retreat {
  public:
    Retreat(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
            const RetreatOptions& options, Budget& budget)
        : mesh_(mesh), topology_(topology), surface_(surface), options_(options), budget_(budget),
          touching_(mesh, topology, kTouching), apart_(mesh, topology, kClearance), fitted_(mesh.positions) {
        unfitted_.assign(options.unfitted.begin(), options.unfitted.end());
        if (unfitted_.empty()) unfitted_ = fitted_;
    }

    RetreatReport run() {
        std::vector<Index> seeds = find_seeds(report_.bad_before, report_.touching_before, flat_before_);
        report_.bad_after = report_.bad_before;
        report_.touching_after = report_.touching_before;
        hold_.assign(mesh_.vertex_count(), Hold::fixed);
        movable_.assign(mesh_.vertex_count(), 0);
        for (int rings : kRings) {
            if (seeds.empty() || budget_.exhausted()) break;
            ++report_.attempts;
            untangle(go_back(seeds, rings));
            part_contacts();
            std::size_t bad = 0, touching = 0, flat = 0;
            seeds = find_seeds(bad, touching, flat);
            budget_.context().log(LogLevel::debug,
                                  fmt::format("{} rings back: {} cells bad, {} flat, {} quads touch", rings,
                                              bad, flat, touching));
        }
        if (report_.attempts > 0) come_home();
        return report_;
    }

  private:
    /// flat: cells that are bad or flat.
    std::vector<Index> find_seeds(std::size_t& bad, std::size_t& touching, std::size_t& flat) const {
        std::vector<Index> cells = find_flat_cells(mesh_, mesh_.positions, kFlatSj, budget_.parallel());
        flat = cells.size();
        bad = find_bad_cells(mesh_, mesh_.positions, budget_.parallel()).size();
        const std::vector<Index> quads = find_all_contacts(touching_);
        touching = quads.size();
        for (Index q : quads) cells.push_back(topology_.boundary_faces[q].cell);
        std::sort(cells.begin(), cells.end());
        cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
        return cells;
    }

    std::vector<Index> find_all_contacts(const BoundaryContacts& contacts) const {
        std::vector<Index> all(contacts.quad_count());
        for (Index q = 0; q < all.size(); ++q) all[q] = q;
        return contacts.touching(mesh_.positions, all, budget_.parallel());
    }

    /// Per vertex: rings of cells away from the seeds, `most` at most.
    std::vector<int> find_rings(std::span<const Index> seeds, int most) const {
        std::vector<int> ring(mesh_.vertex_count(), most);
        std::vector<std::uint8_t> seen(mesh_.cell_count(), 0);
        std::vector<Index> front(seeds.begin(), seeds.end()), next;
        for (Index c : front) seen[c] = 1;
        for (int r = 0; r < most && !front.empty(); ++r) {
            next.clear();
            for (Index c : front)
                for (Index v : mesh_.cells[c]) {
                    if (ring[v] < most) continue;
                    ring[v] = r;
                    for (CellCorner corner : topology_.vertex_cell[v])
                        if (!seen[corner.cell]) seen[corner.cell] = 1, next.push_back(corner.cell);
                }
            front.swap(next);
        }
        // What hangs follows its masters, which must come along.
        const Hanging& hanging = mesh_.hanging;
        for (std::size_t row = 0; row < hanging.count(); ++row)
            for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                ring[hanging.master[k]] = std::min(ring[hanging.master[k]], ring[hanging.vertex[row]]);
        return ring;
    }

    /// Puts the neighbourhood of the seeds where it was before fitting, with a gradual passage to the rest.
    /// Returns what of it may move.
    std::vector<std::uint8_t> go_back(std::span<const Index> seeds, int rings) {
        const int blend = rings + kBlendRings, most = blend + kMovingRings;
        const std::vector<int> ring = find_rings(seeds, most);
        const auto bound = surface_.associations();
        std::vector<std::uint8_t> active(mesh_.vertex_count(), 0);
        for (Index v = 0; v < mesh_.vertex_count(); ++v) {
            if (ring[v] >= most) continue;
            if (ring[v] < blend) {
                const double here = ring[v] <= rings ? 0 : double(ring[v] - rings) / (kBlendRings + 1);
                mesh_.positions[v] = unfitted_[v] + here * (mesh_.positions[v] - unfitted_[v]);
                hold_[v] = Hold::anchored;
                movable_[v] = 1;
            } else if (hold_[v] == Hold::fixed) {
                hold_[v] = Hold::home;
                movable_[v] = bound[v].kind != EntityKind::corner;
            }
            active[v] = movable_[v];
        }
        apply_hanging(mesh_, budget_.parallel());
        return active;
    }

    /// Untangles with the boundary drawn to where it is, less and less firmly round what stays bad.
    void untangle(const std::vector<std::uint8_t>& active) {
        anchor_ = mesh_.positions;
        untangle_held(active, kPull);
        for (double pull : kLoosePulls) {
            const std::vector<Index> bad = find_bad_cells(mesh_, mesh_.positions, budget_.parallel());
            if (bad.empty() || budget_.exhausted()) return;
            untangle_held(movable_neighbourhood(mesh_, topology_, active, bad, kLooseRings), pull);
        }
    }

    /// Draws quads in contact into their own cells, away from one another.
    void part_contacts() {
        for (int round = 0; round < kPartRounds && !budget_.exhausted(); ++round) {
            const std::vector<Index> quads =
                find_all_contacts(touching_).empty() ? std::vector<Index>{} : find_all_contacts(apart_);
            if (quads.empty()) return;
            anchor_ = mesh_.positions;
            std::vector<Index> cells;
            for (Index q : quads) {
                cells.push_back(topology_.boundary_faces[q].cell);
                for (Index v : apart_.quad(q)) anchor_[v] += kPartStep * compute_push(apart_.quad(q));
            }
            untangle_held(movable_neighbourhood(mesh_, topology_, movable_, cells, kLooseRings), kPull);
        }
    }

    /// One edge long, into the mesh.
    Point compute_push(const Quad& quad) const {
        const auto at = [&](int k) { return mesh_.positions[quad[k % 4]]; };
        const Point normal = glm::cross(at(2) - at(0), at(3) - at(1));
        const double length = glm::length(normal);
        double edge = 0;
        for (int k = 0; k < 4; ++k) edge += 0.25 * glm::distance(at(k), at(k + 1));
        return length > 0 ? -edge / length * normal : Point(0);
    }

    void untangle_held(std::span<const std::uint8_t> moving, double pull) {
        std::size_t moved = 0;
        for (Problem& part : Problem::split(Problem(mesh_, topology_, moving))) {
            part.update_lengths(mesh_.positions, budget_.parallel());
            HomeMotion motion(part, surface_, hold_, anchor_);
            motion.update(pull);
            Newton newton(part, mesh_.positions, &motion, budget_);
            untangle_regularised(newton, kUntangleRounds, budget_);
            moved += part.dof_count();
        }
        report_.moved = std::max(report_.moved, moved);
    }

    void come_home() {
        // Cells that are still bad stay as they are: the barrier knows only valid ones.
        for (Index c : find_bad_cells(mesh_, mesh_.positions, budget_.parallel()))
            for (Index v : mesh_.cells[c]) set_fixed(v);
        for (Index v = 0; v < mesh_.vertex_count(); ++v)
            if (hold_[v] == Hold::anchored) hold_[v] = Hold::drawn;
        AllowedContacts allowed;
        for (Problem& part : Problem::split(Problem(mesh_, topology_, movable_))) {
            Homecoming homecoming(part, topology_, surface_, apart_, mesh_.positions, hold_, allowed,
                                  budget_);
            homecoming.run();
        }
        const AwayMesh away{&mesh_, &topology_, &surface_, &apart_, &allowed, movable_};
        for (EntityKind kind : {EntityKind::corner, EntityKind::curve, EntityKind::patch})
            bring_home(away, kind, kLeastSjHome, mesh_.positions, hold_, budget_);
        give_up_beyond_bound(Problem(mesh_, topology_, movable_));
        std::size_t bad = 0, touching = 0, flat = 0;
        find_seeds(bad, touching, flat);
        const std::size_t now = bad + touching, before = report_.bad_before + report_.touching_before;
        if (now > before || (now == before && flat >= flat_before_)) {
            mesh_.positions = fitted_;
            return;
        }
        report_.bad_after = bad;
        report_.touching_after = touching;
    }

    void set_fixed(Index v) {
        movable_[v] = 0;
        if (mesh_.hanging.empty() || topology_.hanging_row[v] == kNoIndex) return;
        const Index row = topology_.hanging_row[v];
        for (std::size_t k = mesh_.hanging.offset[row]; k < mesh_.hanging.offset[row + 1]; ++k)
            movable_[mesh_.hanging.master[k]] = 0;
    }

    /// Connected parts in which a vertex ends farther off than allowed go back to the input.
    void give_up_beyond_bound(const Problem& problem) {
        const auto bound = surface_.associations();
        UnionFind parts = find_dof_parts(problem);
        std::vector<std::uint8_t> given_up(problem.dof_count(), 0);
        for (Index d = 0; d < problem.dof_count(); ++d) {
            const Index v = problem.dof_vertex()[d];
            if (bound[v].kind == EntityKind::interior || hold_[v] == Hold::home) continue;
            if (surface_.project(bound[v], mesh_.positions[v]).distance <= options_.max_deviation) continue;
            ++report_.beyond_max;
            given_up[parts.find(d)] = 1;
        }
        if (report_.beyond_max == 0) return;
        for (Index d = 0; d < problem.dof_count(); ++d)
            if (given_up[parts.find(d)]) {
                const Index v = problem.dof_vertex()[d];
                mesh_.positions[v] = fitted_[v];
            }
        apply_hanging(mesh_, budget_.parallel());
    }

    HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel& surface_;
    const RetreatOptions& options_;
    Budget& budget_;
    const BoundaryContacts touching_, apart_;
    const std::vector<Point> fitted_;
    std::vector<Point> unfitted_, anchor_;
    std::vector<Hold> hold_;
    std::vector<std::uint8_t> movable_;
    RetreatReport report_;
    std::size_t flat_before_ = 0;
};

} // namespace

RetreatReport retreat(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                      const RetreatOptions& options, Context& context) {
    OptimizeOptions limits;
    limits.time_limit_s = options.time_limit_s;
    Budget budget(limits, context);
    return Retreat(mesh, topology, surface, options, budget).run();
}

} // namespace hexopt
