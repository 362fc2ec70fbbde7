#include "pipeline/move_onto_cad.hpp"

#include "mesh/hanging.hpp"
#include "pipeline/undo_contacts.hpp"
#include "quality/cell_quality.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kMatch_rel = 1e-4; ///< of the diagonal: as far as gaps are closed by default
constexpr double kOff_rel = 1e-7;   ///< of the diagonal: farther from the triangles a vertex was let off them
constexpr std::array<double, 5> kShare = {1, 0.5, 0.25, 0.125, 0}; ///< of the way to the exact point

struct Target {
    Index vertex;
    Point from, exact;
    std::size_t step = 0; ///< in kShare

    Point place() const { return from + kShare[step] * (exact - from); }
};

/// Vertices that are bound, with their places on the model's entities.
std::vector<CadQuery> make_queries(const HexMesh& mesh, const BoundaryModel& model, const Parallel& parallel,
                                   std::vector<Index>& vertices) {
    const auto bound = model.associations();
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (bound[v].kind != EntityKind::interior && bound[v].kind != EntityKind::hanging)
            vertices.push_back(v);
    std::vector<CadQuery> queries(vertices.size());
    parallel.for_each(vertices.size(), 1024, [&](std::size_t i) {
        const Index v = vertices[i];
        const EntityKind kind = bound[v].kind;
        queries[i] = {model.project(bound[v], mesh.positions[v]).point, kind == EntityKind::patch   ? 2
                                                                        : kind == EntityKind::curve ? 1
                                                                                                    : 0};
    });
    return queries;
}

/// Cells that change with the vertices in question, be it through hanging ones; each with those vertices, as
/// numbers of targets.
struct Affected {
    std::vector<Index> cells;
    Csr<Index> targets;
    std::vector<CellValidity> before;
};

Affected find_affected(const HexMesh& mesh, const std::vector<Target>& targets, const Parallel& parallel) {
    std::vector<Index> target_of(mesh.vertex_count(), kNoIndex);
    for (Index t = 0; t < targets.size(); ++t) target_of[targets[t].vertex] = t;
    const std::vector<Index> row = compute_hanging_row(mesh.hanging, mesh.vertex_count());
    Affected affected;
    std::vector<Index> own;
    for (Index c = 0; c < mesh.cell_count(); ++c) {
        own.clear();
        const auto add = [&](Index v) {
            if (target_of[v] != kNoIndex) own.push_back(target_of[v]);
        };
        for (Index v : mesh.cells[c]) {
            add(v);
            if (row.empty() || row[v] == kNoIndex) continue;
            for (std::size_t k = mesh.hanging.offset[row[v]]; k < mesh.hanging.offset[row[v] + 1]; ++k)
                add(mesh.hanging.master[k]);
        }
        if (own.empty()) continue;
        std::sort(own.begin(), own.end());
        own.erase(std::unique(own.begin(), own.end()), own.end());
        affected.cells.push_back(c);
        affected.targets.item.insert(affected.targets.item.end(), own.begin(), own.end());
        affected.targets.offset.push_back(affected.targets.item.size());
    }
    affected.before.resize(affected.cells.size());
    parallel.for_each(affected.cells.size(), 256, [&](std::size_t i) {
        affected.before[i] = compute_cell_validity(cell_points(mesh, affected.cells[i]));
    });
    return affected;
}

bool is_acceptable(const CellValidity& before, const CellValidity& after, double min_sj) {
    if (!before.is_usable()) return !is_worse(after, before);
    return after.is_usable() && after.scaled_jacobian >= std::min(before.scaled_jacobian, min_sj);
}

/// Puts targets back step by step until every cell may be as it is.
Status settle_targets(HexMesh& mesh, std::vector<Target>& targets, const Affected& affected, double min_sj,
                      Context& context) {
    const Parallel& parallel = context.parallel();
    std::vector<std::uint8_t> is_checked(affected.cells.size(), 1), is_bad(affected.cells.size(), 0);
    for (bool goes_on = true; goes_on;) {
        for (const Target& target : targets) mesh.positions[target.vertex] = target.place();
        apply_hanging(mesh, parallel);
        if (context.is_cancelled())
            return make_error(ErrorCode::cancelled, "cad projection", "", "cancelled");
        parallel.for_each(affected.cells.size(), 256, [&](std::size_t i) {
            if (is_checked[i])
                is_bad[i] = !is_acceptable(
                    affected.before[i], compute_cell_validity(cell_points(mesh, affected.cells[i])), min_sj);
        });
        std::vector<std::uint8_t> moves_back(targets.size(), 0);
        for (std::size_t i = 0; i < affected.cells.size(); ++i)
            if (is_bad[i])
                for (Index t : affected.targets[i]) moves_back[t] = targets[t].step + 1 < kShare.size();
        goes_on = false;
        for (std::size_t t = 0; t < targets.size(); ++t) {
            targets[t].step += moves_back[t];
            goes_on = goes_on || moves_back[t];
        }
        for (std::size_t i = 0; i < affected.cells.size(); ++i) {
            is_checked[i] = 0;
            for (Index t : affected.targets[i]) is_checked[i] = is_checked[i] || moves_back[t];
        }
    }
    return Done{};
}

} // namespace

Result<CadReport> move_onto_cad(HexMesh& mesh, const Topology& topology, const BoundaryModel& model,
                                std::span<const CadSource> sources, double min_sj, Context& context) {
    CadReport report;
    std::vector<Index> vertices;
    const std::vector<CadQuery> queries = make_queries(mesh, model, context.parallel(), vertices);
    std::vector<std::optional<CadPoint>> exact(queries.size());
    for (const CadSource& source : sources) {
        const auto points =
            project_on_cad(source.path, source.digest, source.tessellation, kMatch_rel, queries, context);
        if (!points) return points.error();
        for (std::size_t i = 0; i < exact.size(); ++i)
            if ((*points)[i] && (!exact[i] || (*points)[i]->match < exact[i]->match)) exact[i] = (*points)[i];
    }
    std::vector<Target> targets;
    for (std::size_t i = 0; i < exact.size(); ++i)
        if (exact[i]) {
            const Point& from = mesh.positions[vertices[i]];
            const bool is_off = glm::distance(from, queries[i].point) > kOff_rel * model.diagonal();
            targets.push_back({vertices[i], from, exact[i]->point, is_off ? kShare.size() - 1 : 0});
        }
    report.vertices = vertices.size();
    report.unmatched = vertices.size() - targets.size();
    const std::vector<Point> start = mesh.positions;
    const Affected affected = find_affected(mesh, targets, context.parallel());
    if (Status ok = settle_targets(mesh, targets, affected, min_sj, context); !ok) {
        mesh.positions = start;
        return ok.error();
    }
    undo_contacts(mesh, topology, start, min_sj, context.parallel());
    for (const Target& target : targets) {
        const double before = glm::distance(target.from, target.exact),
                     after = glm::distance(mesh.positions[target.vertex], target.exact);
        report.held += target.step > 0 || mesh.positions[target.vertex] != target.place();
        report.largest_before = std::max(report.largest_before, before);
        report.largest_after = std::max(report.largest_after, after);
        report.mean_before += before / static_cast<double>(targets.size());
        report.mean_after += after / static_cast<double>(targets.size());
    }
    return report;
}

} // namespace hexopt
