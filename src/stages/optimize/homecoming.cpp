#include "stages/optimize/homecoming.hpp"

#include "stages/optimize/home_draw.hpp"
#include "stages/optimize/max_min.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

/// Times that a step is taken again with what came into contact held back.
constexpr int kTries = 3;
/// Rings of cells round what came into contact in which it is taken again, and round cells that would be bad
/// between there and the rest, so many times.
constexpr int kRedoneRings = 4, kMostGrowths = 6;
/// Rings round what is away, or came home in the last step, that later steps move.
constexpr int kLaterRings = 4;

} // namespace

Homecoming::Homecoming(Problem& problem, const Topology& topology, const BoundaryModel& surface,
                       const BoundaryContacts& contacts, std::vector<Point>& positions,
                       std::vector<Hold>& hold, AllowedContacts& allowed, Budget& budget)
    : problem_(problem), topology_(topology), surface_(surface), contacts_(contacts), positions_(positions),
      hold_(hold), allowed_(allowed), budget_(budget), anchor_(positions),
      is_dof_(problem.mesh().vertex_count(), 0) {
    const HexMesh& mesh = problem.mesh();
    for (Index v : problem.dof_vertex()) is_dof_[v] = 1;
    std::vector<std::uint8_t> moves = is_dof_;
    for (Index row : problem.hanging_rows()) moves[mesh.hanging.vertex[row]] = 1;
    moving_quads_ = contacts.quads_with(moves);
    contacts.allow_present(positions, moving_quads_, allowed, budget.parallel());
}

void Homecoming::run() {
    static constexpr HomeStep kSteps[] = {{0.1, 0.3}, {1, 0.2}, {10, 0.2}, {100, 0.1}};
    std::vector<Hold> hold_last;
    for (const HomeStep& step : kSteps) {
        if (budget_.exhausted()) return;
        before_ = positions_;
        hold_before_ = hold_;
        if (hold_last.empty())
            HomeDraw(problem_, surface_, positions_, hold_, anchor_, budget_).run(step);
        else
            draw(vertices_round_away(hold_last), step);
        hold_last = hold_before_;
        redo_contacts(step);
    }
}

/// The vertices near those that are away or were before the last step.
std::vector<std::uint8_t> Homecoming::vertices_round_away(std::span<const Hold> hold_last) const {
    std::vector<Index> cells;
    for (Index v : problem_.dof_vertex())
        if (hold_last[v] == Hold::drawn)
            for (CellCorner corner : topology_.vertex_cell[v]) cells.push_back(corner.cell);
    return movable_neighbourhood(problem_.mesh(), topology_, is_dof_, cells, kLaterRings);
}

void Homecoming::draw(std::span<const std::uint8_t> moving, const HomeStep& step) {
    for (Problem& part : Problem::split(Problem(problem_.mesh(), topology_, moving)))
        HomeDraw(part, surface_, positions_, hold_, anchor_, budget_).run(step);
}

/// Takes a step again round what it brought into contact, which stays where it was.
void Homecoming::redo_contacts(const HomeStep& step) {
    std::vector<Index> held_back, cells;
    for (int attempt = 1; attempt <= kTries; ++attempt) {
        const std::vector<Index> touching = new_contacts();
        budget_.context().log(LogLevel::debug,
                              fmt::format("pull {:g}: {} quads touch", step.pull, touching.size()));
        if (touching.empty()) break;
        for (Index q : touching) {
            cells.push_back(topology_.boundary_faces[q].cell);
            for (Index v : contacts_.quad(q)) held_back.push_back(v);
        }
        if (attempt == kTries) {
            positions_ = before_;
            hold_ = hold_before_;
            break;
        }
        const std::vector<std::uint8_t> moving = take_back_near(cells);
        for (Index v : held_back) hold_[v] = Hold::fixed;
        draw(moving, step);
    }
    for (Index v : held_back) hold_[v] = hold_before_[v];
}

/// Undoes the step round some cells, as far as it takes for all cells to be valid; where that was.
std::vector<std::uint8_t> Homecoming::take_back_near(std::vector<Index> cells) {
    const HexMesh& mesh = problem_.mesh();
    for (int attempt = 0; attempt < kMostGrowths; ++attempt) {
        std::vector<std::uint8_t> near = movable_neighbourhood(mesh, topology_, is_dof_, cells, kRedoneRings);
        for (Index v : problem_.dof_vertex())
            if (near[v]) positions_[v] = before_[v], hold_[v] = hold_before_[v];
        const Problem part(mesh, topology_, near);
        part.apply_hanging(positions_);
        const auto measures = measure_cells(part, positions_, budget_.parallel());
        bool any = false;
        for (std::size_t i = 0; i < measures.size(); ++i)
            if (measures[i].has_bad32) cells.push_back(part.cell_id()[i]), any = true;
        if (!any) return near;
    }
    positions_ = before_;
    hold_ = hold_before_;
    return is_dof_;
}

std::vector<Index> Homecoming::new_contacts() const {
    return contacts_.touching(positions_, moving_quads_, allowed_, budget_.parallel());
}

} // namespace hexopt
