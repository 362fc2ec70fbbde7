#include "stages/trim/trim.hpp"

#include "stages/trim/emit_kept.hpp"
#include "stages/trim/partial_faces.hpp"
#include "stages/trim/surface_check.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

namespace hexopt {

namespace {

using trimming::CellGraph;
using trimming::CellSides;
using trimming::KeptCells;

Error trim_error(ErrorCode code, std::string where, std::string reason) {
    return make_error(code, "trim", std::move(where), std::move(reason));
}

std::string place(const Point& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

Status check_options(const TrimOptions& options) {
    if (!(options.depth_h >= 0 && options.depth_h <= 0.5))
        return trim_error(ErrorCode::usage, "", "depth_h must be in 0..0.5");
    if (!(options.part_fraction >= 0 && options.part_fraction <= 1))
        return trim_error(ErrorCode::usage, "", "part_fraction must be in 0..1");
    return Done{};
}

/// The kept cell nearest to the seed, which must touch the seed's own cell.
Result<Index> find_seed_cell(const HexMesh& mesh, const KeptCells& kept, const Point& seed) {
    Index best = kNoIndex;
    double nearest2 = std::numeric_limits<double>::infinity();
    for (Index c = 0; c < mesh.cell_count(); ++c) {
        if (!kept.is_kept(c)) continue;
        const Point r = trimming::cell_centre(mesh, c) - seed;
        if (glm::dot(r, r) >= nearest2) continue;
        nearest2 = glm::dot(r, r);
        best = c;
    }
    if (best == kNoIndex || nearest2 > 9 * trimming::cell_size(mesh, best) * trimming::cell_size(mesh, best))
        return trim_error(ErrorCode::bad_input, "seed " + place(seed),
                          "not in a kept cell: it is outside, or in a part too thin for the cells there");
    return best;
}

void count_surface(const HexMesh& mesh, const Parallel& parallel, TrimReport& report) {
    const trimming::SurfaceFaults faults = trimming::check_surface(mesh, compute_topology(mesh, parallel));
    report.open_edges = faults.open_edges;
    report.nonmanifold_edges = faults.nonmanifold_edges;
    report.nonmanifold_vertices = faults.nonmanifold_vertices;
}

/// Mends and drops parts until neither changes anything, removing partial sides where asked to.
Status mend_all(const HexMesh& octree, const CellGraph& graph, const CellSides& sides,
                const TrimOptions& options, KeptCells& kept, TrimReport& report) {
    kept.mend();
    std::vector<Index> seed_cells;
    for (const Point& seed : options.seeds) {
        const Result<Index> cell = find_seed_cell(octree, kept, seed);
        if (!cell) return cell.error();
        seed_cells.push_back(*cell);
    }
    kept.keep_parts(seed_cells, options.part_fraction);
    for (;;) {
        const trimming::PartialSides partial = trimming::find_partial_sides(octree, graph, kept);
        const std::size_t filled = trimming::fill_partial(graph, sides, kept, partial);
        const std::size_t removed = filled == 0 && options.partial == PartialFaces::remove
                                        ? trimming::remove_partial(graph, kept, partial)
                                        : 0;
        if (filled + removed == 0) break;
        report.partial_filled += filled;
        report.partial_removed += removed;
        kept.mend();
        std::erase_if(seed_cells, [&](Index c) { return !kept.is_kept(c); });
        kept.keep_parts(seed_cells, options.part_fraction);
    }
    return Done{};
}

} // namespace

Result<TrimOutput> trim(const HexMesh& octree, const Domain& domain, const TrimOptions& options,
                        Context& context, std::vector<Index>* leak_path) {
    (void)leak_path;
    if (Status ok = check_options(options); !ok) return ok.error();
    const SurfaceQueries queries(domain.model);
    const CellGraph graph = trimming::build_cell_graph(octree, context.parallel());
    const bool open_surface = domain.open_edges + domain.nonmanifold_edges > 0;
    const CellSides sides = trimming::find_sides(octree, graph, queries, open_surface, context);
    if (context.is_cancelled()) return trim_error(ErrorCode::cancelled, "", "cancelled");
    TrimOutput output;
    TrimReport& report = output.report;
    report.octree_cells = octree.cell_count();
    report.cut_cells = static_cast<std::size_t>(std::count(sides.cut.begin(), sides.cut.end(), 1));
    report.uncertain_cells = sides.uncertain_cells;
    KeptCells kept(octree, graph, sides, queries, context, report);
    kept.choose(options);
    kept.open_gaps();
    if (Status ok = mend_all(octree, graph, sides, options, kept, report); !ok) return ok.error();
    if (context.is_cancelled()) return trim_error(ErrorCode::cancelled, "", "cancelled");
    const trimming::PartialSides partial = trimming::find_partial_sides(octree, graph, kept);
    report.half_faces = partial.face_rows.size();
    report.half_edges = partial.edges.size();
    output.refine_cells = trimming::cells_to_refine(octree, graph, kept, partial);
    Result<HexMesh> mesh = trimming::emit_kept(octree, graph, kept.kept(), output.kept_cell);
    if (!mesh) return mesh.error();
    output.kept = std::move(mesh).value();
    report.kept_cells = output.kept.cell_count();
    if (report.kept_cells == 0)
        return trim_error(ErrorCode::bad_input, "",
                          "no cell is inside the surface: it is too thin for the cells, or not closed");
    count_surface(output.kept, context.parallel(), report);
    return output;
}

} // namespace hexopt
