#include "stages/optimize/reach_home.hpp"

#include "quality/cell_quality.hpp"
#include "stages/optimize/boundary_contacts.hpp"
#include "stages/optimize/budget.hpp"
#include "stages/optimize/home_motion.hpp"
#include "stages/optimize/max_min.hpp"
#include "stages/optimize/newton.hpp"
#include "stages/optimize/untangle.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr int kRings = 2; ///< of cells round a vertex that give way
/// How vertices are brought home: what is off in `together` rings of cells comes along.
struct Pass {
    int together, rings;
};
constexpr Pass kPasses[] = {{1, kRings}, {0, kRings}};
constexpr int kUntangleRounds = 6; ///< of the regularised energy
constexpr int kRaiseSteps = 10;    ///< of Newton's method
constexpr double kValidEps = 1e-12;
constexpr double kWorthRaising = 0.2; ///< scaled Jacobian that is sought at first, if it was there before
constexpr double kHopeless = 0.05;    ///< of what a cell must reach: from below that it does not
constexpr double kPull = 10;          ///< on other vertices that are off
constexpr double kOff_rel = 1e-9;     ///< of the diagonal: farther off a vertex is not at home
constexpr double kFarther = 1.0001;   ///< so much farther off others may end
/// Quads and edges may leave the surface by so much of what they did before, or of the size of a cell.
constexpr double kDeviates = 1.1, kDeviates_h = 0.1;
/// A little more than what counts as contact in the end.
constexpr ContactLimits kClearance{1.5e-3, 0.001};

OptimizeOptions limits_of(const ReachOptions& options) {
    OptimizeOptions limits;
    limits.time_limit_s = options.time_limit_s;
    return limits;
}

} // namespace

class HomeReacher::Work {
  public:
    Work(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface, const ReachOptions& options,
         Context& context)
        : mesh_(mesh), topology_(topology), surface_(surface), options_(options),
          budget_(limits_of(options), context), contacts_(mesh, topology, kClearance),
          hold_(mesh.vertex_count(), Hold::home), movable_(mesh.vertex_count(), 1),
          place_(mesh.vertex_count()), vertex_stamp_(mesh.vertex_count(), 0),
          cell_stamp_(mesh.cell_count(), 0) {
        hold_all();
        ridge_.resize(mesh.vertex_count());
        for (const auto& [a, b] : surface.feature_edges()) {
            ridge_[a].push_back(b);
            ridge_[b].push_back(a);
        }
        std::vector<Index> all(contacts_.quad_count());
        for (Index q = 0; q < all.size(); ++q) all[q] = q;
        contacts_.allow_present(mesh_.positions, all, allowed_, budget_.parallel());
    }

    std::size_t reach(std::span<const Index> wanted, std::size_t& most) {
        for (const Pass& pass : kPasses) {
            std::vector<Index> left = still_off(wanted);
            while (!left.empty() && most > 0 && !budget_.exhausted()) {
                std::vector<Index> batch = take_apart(left, pass.rings);
                if (batch.size() > most) batch.resize(most);
                most -= batch.size();
                const std::vector<Index> leaving = with_off_beside(batch, pass.together);
                for (Index v : leaving)
                    place_[v] = {project(v, mesh_.positions[v]).point, hold_[v], Hold::home};
                attempt(batch, leaving, pass.rings);
                left = still_off(left);
            }
        }
        return wanted.size() - still_off(wanted).size();
    }

    std::vector<std::uint8_t> put(std::span<const Place> wanted, std::size_t& most) {
        for (const Place& place : wanted) place_[place.vertex] = {place.at, hold_[place.vertex], Hold::fixed};
        for (int rings : {kRings, kRings + 1}) {
            std::vector<Index> left;
            for (const Place& place : wanted)
                if (hold_[place.vertex] != Hold::fixed) left.push_back(place.vertex);
            while (!left.empty() && most > 0 && !budget_.exhausted()) {
                std::vector<Index> batch = take_apart(left, rings);
                if (batch.size() > most) batch.resize(most);
                most -= batch.size();
                attempt(batch, batch, rings);
            }
        }
        std::vector<std::uint8_t> is_there;
        for (const Place& place : wanted) is_there.push_back(hold_[place.vertex] == Hold::fixed);
        return is_there;
    }

  private:
    /// Where a vertex goes, and how it is held before and there.
    struct Goal {
        Point at{0};
        Hold before = Hold::home, there = Hold::home;
    };

    void hold_all() {
        const auto bound = surface_.associations();
        budget_.parallel().for_each(mesh_.vertex_count(), 1024, [&](std::size_t v) {
            const EntityKind kind = bound[v].kind;
            movable_[v] = kind != EntityKind::hanging;
            if (kind == EntityKind::interior || kind == EntityKind::hanging) return;
            if (distance(static_cast<Index>(v)) > kOff_rel * surface_.diagonal())
                hold_[v] = Hold::drawn;
            else
                movable_[v] = kind != EntityKind::corner;
        });
    }

    Projection project(Index v, const Point& query) const {
        return surface_.project(surface_.associations()[v], query);
    }

    /// The vertices and what is off in so many rings of cells round them.
    std::vector<Index> with_off_beside(const std::vector<Index>& vertices, int rings) {
        std::vector<Index> all = vertices;
        for (Index v : vertices)
            for (Index c : cells_round(v, rings))
                for (Index u : mesh_.cells[c])
                    if (hold_[u] == Hold::drawn) all.push_back(u);
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
        return all;
    }

    std::vector<Index> still_off(std::span<const Index> vertices) const {
        std::vector<Index> off;
        for (Index v : vertices)
            if (hold_[v] == Hold::drawn) off.push_back(v);
        return off;
    }

    double distance(Index v) const {
        return surface_.project(surface_.associations()[v], mesh_.positions[v]).distance;
    }

    /// Moves from `left` those whose neighbourhoods share no cells.
    std::vector<Index> take_apart(std::vector<Index>& left, int rings) {
        std::vector<Index> taken, rest;
        std::vector<std::uint8_t> is_used(mesh_.cell_count(), 0);
        for (Index v : left) {
            const std::vector<Index> cells = cells_round(v, rings + 2);
            if (std::any_of(cells.begin(), cells.end(), [&](Index c) { return is_used[c] != 0; })) {
                rest.push_back(v);
                continue;
            }
            for (Index c : cells) is_used[c] = 1;
            taken.push_back(v);
        }
        left.swap(rest);
        return taken;
    }

    /// Cells of a vertex and rings - 1 rings of cells round these, across hanging vertices too.
    std::vector<Index> cells_round(Index v, int rings) {
        ++stamp_;
        std::vector<Index> cells, front = {v}, next;
        const auto reach = [&](Index u) {
            if (vertex_stamp_[u] == stamp_) return;
            vertex_stamp_[u] = stamp_;
            next.push_back(u);
        };
        for (int ring = 0; ring < rings; ++ring) {
            next.clear();
            for (Index u : front)
                for (CellCorner corner : topology_.vertex_cell[u]) {
                    if (cell_stamp_[corner.cell] == stamp_) continue;
                    cell_stamp_[corner.cell] = stamp_;
                    cells.push_back(corner.cell);
                    for (Index w : mesh_.cells[corner.cell]) {
                        reach(w);
                        for (Index m : masters(w)) reach(m);
                    }
                }
            front.swap(next);
        }
        return cells;
    }

    std::span<const Index> masters(Index v) const {
        const Hanging& hanging = mesh_.hanging;
        if (hanging.empty() || topology_.hanging_row[v] == kNoIndex) return {};
        const Index row = topology_.hanging_row[v];
        return {hanging.master.data() + hanging.offset[row], hanging.offset[row + 1] - hanging.offset[row]};
    }

    /// Brings those in `leaving` to their places; `batch`: one of them in each neighbourhood.
    void attempt(const std::vector<Index>& batch, const std::vector<Index>& leaving, int rings) {
        std::vector<std::uint8_t> moving(mesh_.vertex_count(), 0);
        is_leaving_.assign(mesh_.vertex_count(), 0);
        for (Index v : leaving) is_leaving_[v] = 1;
        for (Index v : batch)
            for (Index c : cells_round(v, rings))
                for (Index u : mesh_.cells[c]) {
                    moving[u] = movable_[u];
                    for (Index m : masters(u)) moving[m] = movable_[m];
                }
        saved_ = mesh_.positions;
        std::vector<Problem> parts = Problem::split(Problem(mesh_, topology_, moving));
        for (Problem& part : parts) bring(part);
        undo_contacts(parts);
        for (Index v : leaving)
            movable_[v] = hold_[v] == Hold::drawn || (hold_[v] == Hold::home && !is_corner(v));
    }

    bool is_corner(Index v) const { return surface_.associations()[v].kind == EntityKind::corner; }

    void bring(Problem& part) {
        part.update_lengths(mesh_.positions, budget_.parallel());
        const double worst = worst_cell(part), off_surface = deviation(part);
        for (Index v : part.dof_vertex())
            if (is_leaving_[v]) {
                mesh_.positions[v] = place_[v].at;
                hold_[v] = place_[v].there;
            }
        part.apply_hanging(mesh_.positions);
        HomeMotion motion(part, surface_, hold_, saved_);
        motion.update(kPull);
        Newton newton(part, mesh_.positions, &motion, budget_);
        untangle_regularised(newton, kUntangleRounds, budget_);
        const double floor = std::min(worst, options_.min_sj);
        const double now = raise(part, newton, std::min(worst, std::max(options_.min_sj, kWorthRaising)));
        if (now < floor || drives_away(part) ||
            deviation(part) > std::max(kDeviates * off_surface, kDeviates_h * mean_length(part)))
            take_back(part);
    }

    /// Max-min up to `target`, where that is not too far. Returns the worst cell.
    double raise(const Problem& part, Newton& newton, double target) {
        double least = worst_cell(part);
        if (least < kHopeless * target) return least;
        NewtonOptions steps;
        steps.max_steps = kRaiseSteps;
        steps.cg_tolerance = 1e-3;
        steps.min_relative_decrease = 1e-6;
        std::vector<Point> best(part.dof_count());
        for (const max_min::Strategy& how : max_min::kStrategies)
            for (bool rises = true; rises && least < target && !budget_.exhausted();) {
                for (std::size_t d = 0; d < best.size(); ++d) best[d] = mesh_.positions[part.dof_vertex()[d]];
                const double theta = std::min(least + how.rise, target) + max_min::kMargin;
                newton.minimise({kValidEps, how.shape_weight, max_min::kPenaltyWeight, theta}, steps);
                const double now = worst_cell(part);
                rises = now - least > max_min::kWorthwhile;
                if (now > least) {
                    least = now;
                    continue;
                }
                for (std::size_t d = 0; d < best.size(); ++d) mesh_.positions[part.dof_vertex()[d]] = best[d];
                part.apply_hanging(mesh_.positions);
            }
        return least;
    }

    /// Scaled Jacobian; below any where a cell is not valid.
    double worst_cell(const Problem& part) const {
        double worst = 1;
        for (Index c : part.cell_id()) {
            const CellValidity cell = compute_cell_validity(cell_points(mesh_, c));
            worst = std::min(worst, cell.is_usable() ? cell.scaled_jacobian : -2.0);
        }
        return worst;
    }

    bool drives_away(const Problem& part) const {
        double before = kOff_rel * surface_.diagonal(), now = 0;
        const auto bound = surface_.associations();
        for (Index v : part.dof_vertex()) {
            if (hold_[v] != Hold::drawn) continue;
            before = std::max(before, surface_.project(bound[v], saved_[v]).distance);
            now = std::max(now, distance(v));
        }
        return now > kFarther * before;
    }

    /// Largest distance from the surface of the quads that a part moves, and of edges along curves from
    /// these.
    double deviation(const Problem& part) {
        std::vector<Index> quads;
        double largest = 0;
        for (Index v : part.dof_vertex()) {
            const std::span<const Index> at = contacts_.vertex_quad()[v];
            quads.insert(quads.end(), at.begin(), at.end());
            for (Index u : ridge_[v]) largest = std::max(largest, edge_deviation(v, u));
        }
        std::sort(quads.begin(), quads.end());
        quads.erase(std::unique(quads.begin(), quads.end()), quads.end());
        for (Index q : quads) {
            std::array<Point, 4> x;
            for (int k = 0; k < 4; ++k) x[k] = mesh_.positions[contacts_.quad(q)[k]];
            Index hint = kNoIndex;
            largest = std::max(largest, surface_.quad_deviation(x, kNoIndex, hint));
        }
        return largest;
    }

    static double mean_length(const Problem& part) {
        double sum = 0;
        for (float inverse : part.inverse_length()) sum += 1.0 / inverse;
        return sum / static_cast<double>(part.cell_count());
    }

    double edge_deviation(Index a, Index b) const {
        const auto bound = surface_.associations();
        const Association& on = bound[a].kind == EntityKind::curve ? bound[a] : bound[b];
        if (on.kind != EntityKind::curve) return 0;
        return surface_.project(on, 0.5 * (mesh_.positions[a] + mesh_.positions[b])).distance;
    }

    void take_back(const Problem& part) {
        for (Index v : part.dof_vertex()) {
            mesh_.positions[v] = saved_[v];
            if (is_leaving_[v]) hold_[v] = place_[v].before;
        }
        part.apply_hanging(mesh_.positions);
    }

    void undo_contacts(const std::vector<Problem>& parts) {
        std::vector<Index> part_of(mesh_.vertex_count(), kNoIndex);
        std::vector<std::uint8_t> moves(mesh_.vertex_count(), 0), is_back(parts.size(), 0);
        for (Index p = 0; p < parts.size(); ++p)
            for (Index c : parts[p].cell_id())
                for (Index v : mesh_.cells[c])
                    if (!parts[p].shares(v).empty()) part_of[v] = p, moves[v] = 1;
        const std::vector<Index> quads = contacts_.quads_with(moves);
        // A part may touch one that went back.
        for (bool any = true; any;) {
            any = false;
            for (Index q : contacts_.touching(mesh_.positions, quads, allowed_, budget_.parallel())) {
                for (Index v : contacts_.quad(q)) {
                    const Index p = part_of[v];
                    if (p == kNoIndex || is_back[p]) continue;
                    take_back(parts[p]);
                    is_back[p] = 1, any = true;
                }
            }
        }
    }

    HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel& surface_;
    const ReachOptions options_;
    Budget budget_;
    const BoundaryContacts contacts_;
    std::vector<Hold> hold_;
    std::vector<std::uint8_t> movable_;     ///< per vertex
    AllowedContacts allowed_;               ///< at the start
    std::vector<Goal> place_;               ///< per vertex: of those that are leaving
    std::vector<std::vector<Index>> ridge_; ///< per vertex: other ends of its edges along curves
    std::vector<std::uint8_t> is_leaving_;  ///< per vertex: in this attempt
    std::vector<Point> saved_;
    std::vector<Index> vertex_stamp_, cell_stamp_; ///< of the last neighbourhood that each was in
    Index stamp_ = 0;
};

HomeReacher::HomeReacher(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                         const ReachOptions& options, Context& context)
    : work_(std::make_unique<Work>(mesh, topology, surface, options, context)) {}
HomeReacher::~HomeReacher() = default;

std::size_t HomeReacher::reach(std::span<const Index> wanted, std::size_t& most) {
    return work_->reach(wanted, most);
}

std::vector<std::uint8_t> HomeReacher::put(std::span<const Place> wanted, std::size_t& most) {
    return work_->put(wanted, most);
}

} // namespace hexopt
