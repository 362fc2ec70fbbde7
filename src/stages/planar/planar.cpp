#include "stages/planar/planar.hpp"

#include "stages/planar/outline_deviation.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

double gap_between(const QuadMesh& mesh, const QuadMesh::WallEdge& edge, const OutlineCurves& curves) {
    const QuadMesh::Place &a = mesh.place[edge.a], &b = mesh.place[edge.b];
    const double length = curves.length(a.loop), gap = b.s - a.s;
    return gap - std::floor(gap / length) * length;
}

} // namespace

Result<PlanarFit> fit_outline(const HexMesh& quadtree, const OutlineCurves& curves,
                              const QuadTrimOptions& options, Context& context) {
    Result<TrimmedQuads> trimmed = trim_quads(quadtree, curves, options, context);
    if (!trimmed) return trimmed.error();
    PlanarFit out;
    out.cut_cells = trimmed->cut_cells;
    out.removed_cells = trimmed->removed_cells;
    out.dropped_cells = trimmed->dropped_cells;
    out.asked_to_join = trimmed->asked_to_join;
    out.refine_cells = std::move(trimmed->refine_cells);
    if (!out.refine_cells.empty()) return out;
    QuadMesh& mesh = trimmed->mesh;
    out.kept_cells = mesh.quads.size();
    for (const KeptLoop& loop : trimmed->loops) {
        if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "fit", "", "cancelled");
        const std::vector<WallLink> links = match_loop(loop, mesh.positions, curves);
        if (!links.empty()) {
            add_wall_row(loop, links, curves, mesh, out.row);
            continue;
        }
        if (!options.may_refine) {
            return Error{ErrorCode::bad_input,
                         "fit",
                         "",
                         {fmt::format("cells are too large for the corners of the outline through {}",
                                      curves.describe(curves.point(loop.outline, 0))),
                          "give smaller cells (--size, --cells)"}};
        }
        for (Index quad : loop.quads) out.refine_cells.push_back(mesh.cell[quad]);
    }
    std::sort(out.refine_cells.begin(), out.refine_cells.end());
    out.refine_cells.erase(std::unique(out.refine_cells.begin(), out.refine_cells.end()),
                           out.refine_cells.end());
    if (out.refine_cells.empty()) out.mesh = std::move(mesh);
    return out;
}

std::vector<Index> find_coarse_cells(const QuadMesh& mesh, const HexMesh& quadtree,
                                     const OutlineCurves& curves, double largest_deviation) {
    std::vector<SegmentTree::Segment> coarse;
    for (const QuadMesh::WallEdge& edge : mesh.wall) {
        if (largest_deviation <= 0) break;
        const QuadMesh::Place& from = mesh.place[edge.a];
        if (curves.chord_deviation(from.loop, from.s, from.s + gap_between(mesh, edge, curves)) >
            largest_deviation)
            coarse.push_back({mesh.positions[edge.a], mesh.positions[edge.b]});
    }
    for (Index e : find_wall_contacts(mesh))
        coarse.push_back({mesh.positions[mesh.wall[e].a], mesh.positions[mesh.wall[e].b]});
    for (std::size_t q = 0; q < mesh.quads.size(); ++q) {
        if (quad_scaled_jacobian(mesh, q) > 0) continue;
        for (int k = 0; k < 4; ++k)
            coarse.push_back({mesh.positions[mesh.quads[q][k]], mesh.positions[mesh.quads[q][(k + 1) % 4]]});
    }
    std::vector<Index> cells;
    const SegmentTree tree(std::move(coarse));
    for (Index c = 0; tree.size() > 0 && c < quadtree.cell_count(); ++c) {
        Box2 box;
        for (int k = 0; k < 4; ++k) box.add(Point2(quadtree.positions[quadtree.cells[c][k]]));
        if (tree.meets(box)) cells.push_back(c);
    }
    return cells;
}

} // namespace hexopt
