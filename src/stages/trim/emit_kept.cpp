#include "stages/trim/emit_kept.hpp"

#include "mesh/hanging.hpp"

#include <algorithm>

namespace hexopt::trimming {

namespace {

/// Rows of the kept mesh's hanging vertices, before they are closed. An edge goes before a face, since what
/// is inside an edge depends on its ends alone.
class HangingRows {
  public:
    HangingRows(const HexMesh& octree, const CellGraph& graph, std::span<const std::uint8_t> kept,
                std::span<const Index> old2new)
        : octree_(octree), graph_(graph), kept_(kept), old2new_(old2new), done_(octree.vertex_count(), 0) {}

    Hanging collect() {
        graph_.for_each_split_edge([&](std::span<const CellGraph::EdgeMiddle> edge) {
            if (!is_held(edge[0].a, edge[0].b)) return;
            for (const auto& m : edge) {
                const double t = double(m.place) / (m.count + 1);
                append(m.vertex, {m.a, m.b}, {1 - t, t});
            }
        });
        for (const CellGraph::FaceMiddle& m : graph_.face_middles) {
            const CellFace face = graph_.coarse_faces[m.row];
            if (!kept_[face.cell]) continue;
            const Quad q = face_vertices(octree_, face);
            append(m.vertex, {q[0], q[1], q[2], q[3]}, face_weights(m, q));
        }
        return std::move(rows_);
    }

  private:
    bool is_held(Index a, Index b) const {
        for (CellCorner at : graph_.vertex_cell[a])
            if (kept_[at.cell] && has_edge(octree_.cells[at.cell], a, b)) return true;
        return false;
    }

    /// The centre, or what the octree says where a face is cut more than once.
    std::vector<double> face_weights(const CellGraph::FaceMiddle& m, const Quad& quad) const {
        std::vector<double> weights(4, 0.25);
        const auto& hanging = octree_.hanging;
        const auto row = std::lower_bound(hanging.vertex.begin(), hanging.vertex.end(), m.vertex);
        if (graph_.fine_faces[m.row].size() <= 4 || row == hanging.vertex.end() || *row != m.vertex)
            return weights;
        std::vector<double> given(4, 0);
        double sum = 0;
        const auto r = static_cast<std::size_t>(row - hanging.vertex.begin());
        for (std::size_t k = hanging.offset[r]; k < hanging.offset[r + 1]; ++k) {
            const auto at = std::find(quad.begin(), quad.end(), hanging.master[k]);
            if (at == quad.end()) continue;
            given[static_cast<std::size_t>(at - quad.begin())] = hanging.weight[k];
            sum += hanging.weight[k];
        }
        return std::abs(sum - 1) < 1e-12 ? given : weights;
    }

    void append(Index vertex, std::vector<Index> masters, const std::vector<double>& weights) {
        if (old2new_[vertex] == kNoIndex || done_[vertex]) return;
        done_[vertex] = 1;
        for (Index& m : masters) m = old2new_[m];
        append_row(rows_, old2new_[vertex], masters, weights);
    }

    const HexMesh& octree_;
    const CellGraph& graph_;
    std::span<const std::uint8_t> kept_;
    std::span<const Index> old2new_;
    std::vector<std::uint8_t> done_;
    Hanging rows_;
};

} // namespace

Result<HexMesh> emit_kept(const HexMesh& octree, const CellGraph& graph, std::span<const std::uint8_t> kept,
                          std::vector<Index>& kept_cell) {
    HexMesh mesh;
    std::vector<Index> old2new(octree.vertex_count(), kNoIndex);
    for (Index c = 0; c < kept.size(); ++c) {
        if (!kept[c]) continue;
        kept_cell.push_back(c);
        for (Index v : octree.cells[c]) old2new[v] = 0;
    }
    for (Index v = 0; v < old2new.size(); ++v) {
        if (old2new[v] == kNoIndex) continue;
        old2new[v] = static_cast<Index>(mesh.positions.size());
        mesh.positions.push_back(octree.positions[v]);
    }
    mesh.cells.reserve(kept_cell.size());
    for (Index c : kept_cell) {
        Cell cell = octree.cells[c];
        for (Index& v : cell) v = old2new[v];
        mesh.cells.push_back(cell);
        if (!octree.level.empty()) mesh.level.push_back(octree.level[c]);
    }
    Result<Hanging> hanging =
        close_hanging(HangingRows(octree, graph, kept, old2new).collect(), mesh.vertex_count());
    if (!hanging) return hanging.error();
    mesh.hanging = std::move(hanging).value();
    return mesh;
}

} // namespace hexopt::trimming
