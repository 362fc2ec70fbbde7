#include "stages/optimize/homecoming.hpp"

#include "stages/optimize/hex_kernels.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr double kValidEps = 1e-12;
constexpr int kMostNewtonSteps = 6;
/// Times that a step is taken again with what came into contact held back.
constexpr int kTries = 3;

Csr<Index> invert(const std::vector<std::array<Index, 2>>& key_value, std::size_t keys) {
    Csr<Index> rows;
    rows.offset.assign(keys + 1, 0);
    for (const auto& [key, value] : key_value) ++rows.offset[key + 1];
    for (std::size_t k = 0; k < keys; ++k) rows.offset[k + 1] += rows.offset[k];
    rows.item.resize(key_value.size());
    std::vector<std::size_t> next(rows.offset.begin(), rows.offset.end() - 1);
    for (const auto& [key, value] : key_value) rows.item[next[key]++] = value;
    return rows;
}

} // namespace

Homecoming::Homecoming(Problem& problem, const BoundaryModel& surface, const BoundaryContacts& contacts,
                       std::vector<Point>& positions, std::vector<Hold>& hold, AllowedContacts& allowed,
                       Budget& budget)
    : problem_(problem), surface_(surface), contacts_(contacts), positions_(positions), hold_(hold),
      allowed_(allowed), budget_(budget), anchor_(positions), motion_(problem, surface, hold, anchor_),
      newton_(problem, positions, &motion_, budget) {
    const HexMesh& mesh = problem.mesh();
    std::vector<std::uint8_t> moves(mesh.vertex_count(), 0);
    for (Index v : problem.dof_vertex()) moves[v] = 1;
    std::vector<std::array<Index, 2>> dof_row, dof_cell;
    for (Index row : problem.hanging_rows())
        for (DofShare share : problem.shares(mesh.hanging.vertex[row])) {
            dof_row.push_back({share.dof, row});
            moves[mesh.hanging.vertex[row]] = 1;
        }
    for (Index c = 0; c < problem.cell_count(); ++c)
        for (Index v : problem.cell(c))
            for (DofShare share : problem.shares(v)) dof_cell.push_back({share.dof, c});
    std::sort(dof_cell.begin(), dof_cell.end());
    dof_cell.erase(std::unique(dof_cell.begin(), dof_cell.end()), dof_cell.end());
    dof_row_ = invert(dof_row, problem.dof_count());
    dof_cell_ = invert(dof_cell, problem.dof_count());
    moving_quads_ = contacts.quads_with(moves);
    contacts.allow_present(positions, moving_quads_, allowed, budget.parallel());
}

void Homecoming::run() {
    static constexpr Step kSteps[] = {{0.1, 0.3}, {1, 0.2}, {10, 0.2}, {100, 0.1}};
    for (const Step& step : kSteps) {
        if (budget_.exhausted()) return;
        const std::vector<Point> before = positions_;
        const std::vector<Hold> hold_before = hold_;
        std::vector<Index> held_back;
        bool done = false;
        for (int attempt = 0; attempt < kTries && !done; ++attempt) {
            done = try_step(step);
            if (done) break;
            // What came into contact stays where it was for this step.
            const std::vector<Index> touching = new_contacts();
            positions_ = before;
            hold_ = hold_before;
            for (Index q : touching)
                for (Index v : contacts_.quad(q)) held_back.push_back(v);
            for (Index v : held_back) hold_[v] = Hold::fixed;
        }
        if (!done) positions_ = before;
        for (Index v : held_back) hold_[v] = hold_before[v];
        if (!done) hold_ = hold_before;
    }
}

/// False where it brings quads into contact.
bool Homecoming::try_step(const Step& step) {
    problem_.update_lengths(positions_, budget_.parallel());
    motion_.update(step.pull);
    NewtonOptions options;
    options.max_steps = kMostNewtonSteps;
    const NewtonResult result = newton_.minimise({kValidEps}, options);
    put_home(step.least_sj);
    const std::size_t contacts = new_contacts().size();
    budget_.context().log(LogLevel::debug, fmt::format("pull {:g}: {} steps, {} cg, {} quads touch, {} away",
                                                       step.pull, result.steps, result.cg_iterations,
                                                       contacts, motion_.limited().size()));
    return contacts == 0;
}

std::vector<Index> Homecoming::new_contacts() const {
    return contacts_.touching(positions_, moving_quads_, allowed_, budget_.parallel());
}

void Homecoming::put_home(double least_sj) {
    const auto bound = surface_.associations();
    for (EntityKind kind : {EntityKind::corner, EntityKind::curve, EntityKind::patch})
        for (Index d : motion_.limited()) {
            const Index v = problem_.dof_vertex()[d];
            if (bound[v].kind == kind && hold_[v] == Hold::drawn && comes_home(d, least_sj))
                hold_[v] = Hold::home;
        }
    motion_.update(1);
}

/// Puts a vertex on what it is bound to if its cells stay valid and either good enough or no worse.
bool Homecoming::comes_home(Index dof, double least_sj) {
    const Index v = problem_.dof_vertex()[dof];
    const auto place = [&](const Point& p) {
        positions_[v] = p;
        const Hanging& hanging = problem_.mesh().hanging;
        for (Index row : dof_row_[dof]) {
            Point sum(0);
            for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                sum += hanging.weight[k] * positions_[hanging.master[k]];
            positions_[hanging.vertex[row]] = sum;
        }
    };
    const Point old = positions_[v];
    const double before = least_sj_around(dof);
    place(surface_.project(surface_.associations()[v], old).point);
    const double after = least_sj_around(dof);
    if (after > 0 && after >= std::min(before, least_sj)) return true;
    place(old);
    return false;
}

/// -1 where a cell is bad.
double Homecoming::least_sj_around(Index dof) const {
    static const std::array<float, kGroup> ones = [] {
        std::array<float, kGroup> a;
        a.fill(1);
        return a;
    }();
    static const std::array<std::uint32_t, kGroup> all = [] {
        std::array<std::uint32_t, kGroup> a;
        a.fill(kAllTets);
        return a;
    }();
    double least = 1;
    HexMeasure lanes;
    std::array<Index, kGroup> ids;
    const std::span<const Index> cells = dof_cell_[dof];
    for (std::size_t first = 0; first < cells.size(); first += kGroup) {
        const int count = static_cast<int>(std::min<std::size_t>(kGroup, cells.size() - first));
        for (int i = 0; i < count; ++i)
            ids[i] = problem_.cell_id()[cells[first + static_cast<std::size_t>(i)]];
        HexGroup group{
            positions_.data(), problem_.mesh().cells.data(), ones.data(), ones.data(), all.data(), count,
            kValidEps};
        group.cell_id = ids.data();
        hex_kernels().measure(group, lanes);
        for (int i = 0; i < count; ++i)
            least = std::min(least, lanes.min_det32[i] > 0 ? lanes.min_sj[i] : -1.0);
    }
    return least;
}

} // namespace hexopt
