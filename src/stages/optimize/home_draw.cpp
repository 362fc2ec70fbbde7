#include "stages/optimize/home_draw.hpp"

#include "stages/optimize/hex_kernels.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr double kValidEps = 1e-12;
constexpr int kMostNewtonSteps = 6;
constexpr double kLeastDecrease = 1e-3; ///< of the energy by a step; the next pull changes it anyhow

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

HomeDraw::HomeDraw(Problem& problem, const BoundaryModel& surface, std::vector<Point>& positions,
                   std::vector<Hold>& hold, std::span<const Point> anchor, Budget& budget)
    : problem_(problem), surface_(surface), positions_(positions), hold_(hold), budget_(budget),
      motion_(problem, surface, hold, anchor), newton_(problem, positions, &motion_, budget) {
    const HexMesh& mesh = problem.mesh();
    std::vector<std::array<Index, 2>> dof_row, dof_cell;
    for (Index row : problem.hanging_rows())
        for (DofShare share : problem.shares(mesh.hanging.vertex[row])) dof_row.push_back({share.dof, row});
    for (Index c = 0; c < problem.cell_count(); ++c)
        for (Index v : problem.cell(c))
            for (DofShare share : problem.shares(v)) dof_cell.push_back({share.dof, c});
    std::sort(dof_cell.begin(), dof_cell.end());
    dof_cell.erase(std::unique(dof_cell.begin(), dof_cell.end()), dof_cell.end());
    dof_row_ = invert(dof_row, problem.dof_count());
    dof_cell_ = invert(dof_cell, problem.dof_count());
}

void HomeDraw::run(const HomeStep& step) {
    problem_.update_lengths(positions_, budget_.parallel());
    motion_.update(step.pull);
    NewtonOptions options;
    options.max_steps = kMostNewtonSteps;
    options.min_relative_decrease = kLeastDecrease;
    const NewtonResult result = newton_.minimise({kValidEps}, options);
    put_home(step.least_sj);
    budget_.context().log(LogLevel::debug, fmt::format("pull {:g}: {} dofs, {} steps, {} cg, {} away",
                                                       step.pull, problem_.dof_count(), result.steps,
                                                       result.cg_iterations, motion_.limited().size()));
}

void HomeDraw::put_home(double least_sj) {
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
bool HomeDraw::comes_home(Index dof, double least_sj) {
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
double HomeDraw::least_sj_around(Index dof) const {
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
