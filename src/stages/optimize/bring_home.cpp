#include "stages/optimize/bring_home.hpp"

#include "stages/optimize/max_min.hpp"
#include "stages/optimize/untangle.hpp"

#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr int kRings = 3;
constexpr int kRounds = 4;
/// More at once in one part never all got home: one that cannot holds the others back.
constexpr std::size_t kMostAtOnce = 20;
constexpr double kPull = 10; ///< on those that stay away

class BringHome {
  public:
    BringHome(const AwayMesh& away, std::span<const std::uint8_t> moving, std::vector<Point>& positions,
              std::vector<Hold>& hold, Budget& budget)
        : away_(away), positions_(positions), hold_(hold), budget_(budget), saved_(positions),
          saved_hold_(hold), moving_(moving.begin(), moving.end()),
          problem_(*away.mesh, *away.topology, moving), parts_(find_dof_parts(problem_)) {
        std::vector<std::uint8_t> moves(away.mesh->vertex_count(), 0);
        for (Index v = 0; v < moves.size(); ++v) moves[v] = !problem_.shares(v).empty();
        quads_ = away.contacts->quads_with(moves);
    }

    std::size_t run(std::span<const Index> leaving, double least_sj) {
        const auto before = measure_cells(problem_, positions_, budget_.parallel());
        for (Index v : leaving) {
            positions_[v] = away_.surface->project(away_.surface->associations()[v], positions_[v]).point;
            hold_[v] = Hold::home;
        }
        problem_.apply_hanging(positions_);
        untangle();
        const auto after = measure_cells(problem_, positions_, budget_.parallel());
        judge(before, after, least_sj);
        std::size_t home = 0;
        for (Index v : leaving) home += hold_[v] == Hold::home;
        return home;
    }

  private:
    struct Part {
        float before = 1, after = 1;
        bool bad = false;
    };

    void untangle() {
        for (Problem& part : Problem::split(Problem(*away_.mesh, *away_.topology, moving_))) {
            HomeMotion motion(part, *away_.surface, hold_, saved_);
            part.update_lengths(saved_, budget_.parallel());
            motion.update(kPull);
            Newton newton(part, positions_, &motion, budget_);
            untangle_regularised(newton, kRounds, budget_);
        }
    }

    void judge(const std::vector<CellMeasure>& before, const std::vector<CellMeasure>& after,
               double least_sj) {
        std::vector<Part> parts(problem_.dof_count());
        for (std::size_t c = 0; c < after.size(); ++c) {
            Part& part = parts[part_of_cell(c)];
            part.before = std::min(part.before, before[c].min_sj);
            part.after = std::min(part.after, after[c].min_sj);
            part.bad = part.bad || after[c].has_bad32;
        }
        std::vector<std::uint8_t> back(parts.size(), 0);
        for (std::size_t p = 0; p < parts.size(); ++p)
            back[p] = parts[p].bad || parts[p].after < std::min<double>(parts[p].before, least_sj);
        take_back(back);
        // A part may touch one that went back.
        for (bool any = true; any;) {
            any = false;
            for (Index q : away_.contacts->touching(positions_, quads_, *away_.allowed, budget_.parallel()))
                for (Index v : away_.contacts->quad(q))
                    for (DofShare share : problem_.shares(v)) {
                        const Index part = parts_.find(share.dof);
                        if (!back[part]) back[part] = 1, any = true;
                    }
            if (any) take_back(back);
        }
    }

    Index part_of_cell(std::size_t c) {
        for (Index v : problem_.cell(c))
            for (DofShare share : problem_.shares(v)) return parts_.find(share.dof);
        return 0;
    }

    void take_back(const std::vector<std::uint8_t>& back) {
        for (Index d = 0; d < problem_.dof_count(); ++d) {
            if (!back[parts_.find(d)]) continue;
            const Index v = problem_.dof_vertex()[d];
            positions_[v] = saved_[v];
            hold_[v] = saved_hold_[v];
        }
        problem_.apply_hanging(positions_);
    }

    const AwayMesh& away_;
    std::vector<Point>& positions_;
    std::vector<Hold>& hold_;
    Budget& budget_;
    const std::vector<Point> saved_;
    const std::vector<Hold> saved_hold_;
    const std::vector<std::uint8_t> moving_;
    Problem problem_;
    UnionFind parts_; ///< of the dofs
    std::vector<Index> quads_;
};

std::vector<std::uint8_t> neighbourhood(const AwayMesh& away, std::span<const Index> vertices) {
    std::vector<Index> cells;
    for (Index v : vertices)
        for (CellCorner corner : away.topology->vertex_cell[v]) cells.push_back(corner.cell);
    return movable_neighbourhood(*away.mesh, *away.topology, away.movable, cells, kRings);
}

/// Those of which not too many share a part.
std::vector<Index> drop_crowds(const AwayMesh& away, std::vector<Index> leaving) {
    const Problem problem(*away.mesh, *away.topology, neighbourhood(away, leaving));
    UnionFind parts = find_dof_parts(problem);
    std::vector<std::size_t> count(problem.dof_count(), 0);
    for (Index v : leaving) ++count[parts.find(problem.vertex_dof(v))];
    std::erase_if(leaving, [&](Index v) { return count[parts.find(problem.vertex_dof(v))] > kMostAtOnce; });
    return leaving;
}

} // namespace

std::size_t bring_home(const AwayMesh& away, EntityKind kind, double least_sj, std::vector<Point>& positions,
                       std::vector<Hold>& hold, Budget& budget) {
    const auto bound = away.surface->associations();
    std::vector<Index> leaving;
    for (Index v = 0; v < hold.size(); ++v)
        if (hold[v] == Hold::drawn && bound[v].kind == kind && away.movable[v]) leaving.push_back(v);
    leaving = drop_crowds(away, std::move(leaving));
    if (leaving.empty() || budget.exhausted()) return 0;
    const std::size_t home =
        BringHome(away, neighbourhood(away, leaving), positions, hold, budget).run(leaving, least_sj);
    budget.context().log(LogLevel::debug, fmt::format("{} of {} brought home", home, leaving.size()));
    return home;
}

} // namespace hexopt
