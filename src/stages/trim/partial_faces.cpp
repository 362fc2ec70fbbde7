#include "stages/trim/partial_faces.hpp"

#include <algorithm>

namespace hexopt::trimming {

namespace {

constexpr float kFillDepth_h = -0.5f;

using Middles = std::span<const CellGraph::EdgeMiddle>;

/// Calls visit(cell) for every kept cell that has the whole edge.
template <class Visit>
void visit_holders(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept, Index a, Index b,
                   const Visit& visit) {
    for (CellCorner at : graph.vertex_cell[a])
        if (kept.is_kept(at.cell) && has_edge(mesh.cells[at.cell], a, b)) visit(at.cell);
}

/// Cells round the line between two neighbouring vertices of an edge.
std::vector<Index> cells_round(const CellGraph& graph, Index a, Index b) {
    std::vector<Index> at_a, at_b;
    graph.gather_star(a, at_a);
    graph.gather_star(b, at_b);
    std::erase_if(at_a, [&](Index c) { return std::find(at_b.begin(), at_b.end(), c) == at_b.end(); });
    return at_a;
}

/// Parts of an edge along which kept cells and others meet, if that is not the whole edge; none either where
/// no vertex inside is on the surface.
struct EdgeParts {
    bool partial = false;
    std::vector<std::array<Index, 2>> on_surface;
};

EdgeParts find_parts(const CellGraph& graph, const KeptCells& kept, Middles edge) {
    EdgeParts parts;
    const auto touches = [&](const auto& m) { return kept.on_surface(m.vertex); };
    if (std::none_of(edge.begin(), edge.end(), touches)) return parts;
    for (std::size_t i = 0; i <= edge.size(); ++i) {
        const Index from = i == 0 ? edge[0].a : edge[i - 1].vertex,
                    to = i == edge.size() ? edge[0].b : edge[i].vertex;
        const std::vector<Index> round = cells_round(graph, from, to);
        const auto is_kept = [&](Index c) { return kept.is_kept(c); };
        if (std::all_of(round.begin(), round.end(), is_kept) ||
            std::none_of(round.begin(), round.end(), is_kept))
            parts.partial = true;
        else
            parts.on_surface.push_back({from, to});
    }
    return parts;
}

/// Whether a face of the cell is part of a larger kept cell's.
bool is_beside_larger(const CellGraph& graph, const KeptCells& kept, Index cell) {
    for (int f = 0; f < 6; ++f) {
        const Index behind = graph.neighbour[cell][static_cast<std::size_t>(f)];
        if (behind == kNoIndex || (behind & CellGraph::kFine) || !kept.is_kept(behind)) continue;
        const auto& back = graph.neighbour[behind];
        if (std::find(back.begin(), back.end(), cell) == back.end()) return true;
    }
    return false;
}

} // namespace

PartialSides find_partial_sides(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept) {
    PartialSides partial;
    for (Index row = 0; row < graph.coarse_faces.size(); ++row) {
        if (!kept.is_kept(graph.coarse_faces[row].cell)) continue;
        const auto fine = graph.fine_faces[row];
        const auto is_kept = [&](CellFace f) { return kept.is_kept(f.cell); };
        if (std::any_of(fine.begin(), fine.end(), is_kept) && !std::all_of(fine.begin(), fine.end(), is_kept))
            partial.face_rows.push_back(row);
    }
    graph.for_each_split_edge([&](Middles edge) {
        bool held = false;
        visit_holders(mesh, graph, kept, edge[0].a, edge[0].b, [&](Index) { held = true; });
        if (!held) return;
        const EdgeParts parts = find_parts(graph, kept, edge);
        if (!parts.partial) return;
        partial.edge_parts.insert(partial.edge_parts.end(), parts.on_surface.begin(), parts.on_surface.end());
        partial.edges.push_back({edge[0].a, edge[0].b});
        std::vector<Index>& middle = partial.edge_middle.emplace_back();
        for (const auto& m : edge) middle.push_back(m.vertex);
    });
    return partial;
}

std::vector<Index> cells_to_refine(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                                   const PartialSides& partial) {
    std::vector<Index> cells;
    for (Index row : partial.face_rows) cells.push_back(graph.coarse_faces[row].cell);
    for (const auto& [a, b] : partial.edges)
        visit_holders(mesh, graph, kept, a, b, [&](Index c) { cells.push_back(c); });
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
}

std::size_t fill_partial(const CellGraph& graph, const CellSides& sides, KeptCells& kept,
                         const PartialSides& partial) {
    std::size_t filled = 0;
    const auto fill_all = [&](std::span<const Index> cells) {
        const auto may_stay = [&](Index c) {
            return kept.is_kept(c) || (sides.depth_h[c] >= kFillDepth_h && kept.may_fill(c));
        };
        if (!std::all_of(cells.begin(), cells.end(), may_stay)) return;
        for (Index c : cells) {
            filled += !kept.is_kept(c);
            kept.fill(c);
        }
    };
    for (Index row : partial.face_rows) {
        std::vector<Index> cells;
        for (CellFace f : graph.fine_faces[row]) cells.push_back(f.cell);
        fill_all(cells);
    }
    for (const auto& [a, b] : partial.edge_parts) fill_all(cells_round(graph, a, b));
    return filled;
}

std::size_t remove_partial(const HexMesh& mesh, const CellGraph& graph, KeptCells& kept,
                           const PartialSides& partial) {
    std::size_t removed = 0;
    const auto remove = [&](Index c) {
        removed += kept.is_kept(c);
        kept.remove(c);
    };
    const auto may_go = [&](Index c) { return kept.is_kept(c) && !is_beside_larger(graph, kept, c); };
    for (Index row : partial.face_rows) {
        if (const Index large = graph.coarse_faces[row].cell; may_go(large))
            remove(large);
        else
            for (CellFace fine : graph.fine_faces[row]) remove(fine.cell);
    }
    for (std::size_t i = 0; i < partial.edges.size(); ++i) {
        const auto [a, b] = partial.edges[i];
        bool all = true;
        visit_holders(mesh, graph, kept, a, b, [&](Index c) { all = all && may_go(c); });
        if (all)
            visit_holders(mesh, graph, kept, a, b, remove);
        else
            for (Index v : partial.edge_middle[i])
                for (CellCorner at : graph.vertex_cell[v]) remove(at.cell);
    }
    return removed;
}

} // namespace hexopt::trimming
