#include "stages/trim/cell_graph.hpp"

#include "mesh/face_groups.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kChunk = 4096;

/// Links faces with equal vertices and returns those used once.
std::vector<CellFace> link_equal_faces(const HexMesh& mesh, CellGraph& graph, const Parallel& parallel) {
    std::vector<std::vector<CellFace>> once((mesh.vertex_count() + kChunk - 1) / kChunk);
    parallel.for_chunks(mesh.vertex_count(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<KeyedFace> faces;
        for (std::size_t v = begin; v < end; ++v) {
            gather_faces(mesh, graph.vertex_cell[v], static_cast<Index>(v), faces);
            for (std::size_t i = 0; i < faces.size(); ++i) {
                if (i + 1 == faces.size() || faces[i + 1].others != faces[i].others) {
                    once[begin / kChunk].push_back(faces[i].face);
                    continue;
                }
                const CellFace a = faces[i].face, b = faces[i + 1].face;
                graph.neighbour[a.cell][a.face] = b.cell;
                graph.neighbour[b.cell][b.face] = a.cell;
                ++i;
            }
        }
    });
    std::vector<CellFace> all;
    for (const auto& part : once) all.insert(all.end(), part.begin(), part.end());
    std::sort(all.begin(), all.end());
    return all;
}

/// Collects what hangs on the faces of larger cells and on the rims of those faces.
class MiddleSearch {
  public:
    MiddleSearch(const HexMesh& mesh, CellGraph& graph) : mesh_(mesh), graph_(graph) {}

    void find() {
        for (Index row = 0; row < graph_.coarse_faces.size(); ++row) search(row);
        std::sort(graph_.edge_middles.begin(), graph_.edge_middles.end());
        const auto last = std::unique(graph_.edge_middles.begin(), graph_.edge_middles.end());
        graph_.edge_middles.erase(last, graph_.edge_middles.end());
        graph_.edge_middles.shrink_to_fit(); // found from each of the faces round an edge
        std::sort(graph_.face_middles.begin(), graph_.face_middles.end());
    }

  private:
    using Directed = std::array<Index, 2>;

    void search(Index row) {
        const Quad quad = face_vertices(mesh_, graph_.coarse_faces[row]);
        std::vector<Directed> rim;
        std::vector<Index> inside;
        for (CellFace part : graph_.fine_faces[row]) {
            const Quad q = face_vertices(mesh_, part);
            for (int k = 0; k < 4; ++k) rim.push_back({q[(k + 1) % 4], q[k]});
            inside.insert(inside.end(), q.begin(), q.end());
        }
        std::sort(rim.begin(), rim.end());
        const std::vector<Directed> all = rim;
        std::erase_if(rim, [&](const Directed& e) {
            return std::binary_search(all.begin(), all.end(), Directed{e[1], e[0]});
        });
        cancel_halved(rim);
        std::vector<Index> on_rim;
        for (const Directed& e : rim) on_rim.push_back(e[0]);
        for (int k = 0; k < 4; ++k) walk(rim, quad[k], quad[(k + 1) % 4]);
        std::sort(inside.begin(), inside.end());
        inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
        for (Index v : inside)
            if (!std::binary_search(on_rim.begin(), on_rim.end(), v)) graph_.face_middles.push_back({v, row});
    }

    /// Where parts are cut along different axes one's whole edge may lie between two others' halves.
    void cancel_halved(std::vector<Directed>& rim) {
        const auto next_of = [&](Index v) {
            return std::lower_bound(rim.begin(), rim.end(), Directed{v, 0});
        };
        std::vector<Directed> gone;
        for (const auto& [a, b] : rim)
            for (auto half = next_of(b); half != rim.end() && (*half)[0] == b; ++half) {
                const Index middle = (*half)[1];
                if (!std::binary_search(rim.begin(), rim.end(), Directed{middle, a})) continue;
                // Of the three edges of the circle the whole one ends where the halves begin.
                if (std::any_of(gone.begin(), gone.end(), [&](const Directed& e) {
                        return e == Directed{a, b};
                    }))
                    continue;
                if (!is_between(a, b, middle)) continue;
                gone.insert(gone.end(), {{a, b}, {b, middle}, {middle, a}});
                graph_.edge_middles.push_back({std::min(a, b), std::max(a, b), 1, 1, middle});
            }
        std::erase_if(
            rim, [&](const Directed& e) { return std::find(gone.begin(), gone.end(), e) != gone.end(); });
    }

    bool is_between(Index a, Index b, Index middle) const {
        const auto& x = mesh_.positions;
        return glm::distance(0.5 * (x[a] + x[b]), x[middle]) < 0.1 * glm::distance(x[a], x[b]);
    }

    /// Follows the rim of the parts, which they list the other way round, from a corner to the next.
    void walk(const std::vector<Directed>& rim, Index from, Index to) {
        std::vector<Index> between;
        for (Index at = from; between.size() <= rim.size();) {
            const auto next = std::lower_bound(rim.begin(), rim.end(), Directed{at, 0});
            if (next == rim.end() || (*next)[0] != at) return;
            at = (*next)[1];
            if (at == to) break;
            between.push_back(at);
        }
        if (from > to) std::reverse(between.begin(), between.end());
        const auto count = static_cast<std::uint16_t>(between.size());
        for (std::uint16_t i = 0; i < count; ++i)
            graph_.edge_middles.push_back({std::min(from, to), std::max(from, to), count,
                                           static_cast<std::uint16_t>(i + 1), between[i]});
    }

    const HexMesh& mesh_;
    CellGraph& graph_;
};

struct Incidence {
    Index vertex, cell;
    auto operator<=>(const Incidence&) const = default;
};

/// Items by row, in the order of the list.
template <class Row, class Item>
Csr<Index> to_csr(const std::vector<Incidence>& list, std::size_t rows, const Row& row, const Item& item) {
    Csr<Index> csr;
    csr.offset.assign(rows + 1, 0);
    for (const Incidence& i : list) ++csr.offset[row(i)];
    std::size_t end = 0;
    for (std::size_t& offset : csr.offset) offset = end += offset;
    csr.item.resize(end);
    // Filling from the last one backwards turns the ends of the rows into their starts.
    for (auto i = list.rbegin(); i != list.rend(); ++i) csr.item[--csr.offset[row(*i)]] = item(*i);
    return csr;
}

void link_hanging(const HexMesh& mesh, CellGraph& graph) {
    std::vector<Incidence> list;
    for (const CellGraph::FaceMiddle& m : graph.face_middles)
        list.push_back({m.vertex, graph.coarse_faces[m.row].cell});
    for (const CellGraph::EdgeMiddle& m : graph.edge_middles)
        for (CellCorner at : graph.vertex_cell[m.a])
            if (has_edge(mesh.cells[at.cell], m.a, m.b)) list.push_back({m.vertex, at.cell});
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    const auto vertex = [](const Incidence& i) { return i.vertex; };
    const auto cell = [](const Incidence& i) { return i.cell; };
    graph.vertex_coarse = to_csr(list, mesh.vertex_count(), vertex, cell);
    graph.cell_hanging = to_csr(list, mesh.cell_count(), cell, vertex);
}

} // namespace

bool has_edge(const Cell& cell, Index a, Index b) {
    return std::any_of(hex::kEdgeVertex.begin(), hex::kEdgeVertex.end(), [&](const auto& e) {
        return (cell[e[0]] == a && cell[e[1]] == b) || (cell[e[0]] == b && cell[e[1]] == a);
    });
}

void CellGraph::gather_star(Index vertex, std::vector<Index>& star) const {
    star.clear();
    for (CellCorner at : vertex_cell[vertex]) star.push_back(at.cell);
    const auto coarse = vertex_coarse[vertex];
    star.insert(star.end(), coarse.begin(), coarse.end());
}

CellGraph build_cell_graph(const HexMesh& mesh, const Parallel& parallel) {
    CellGraph graph;
    std::array<Index, 6> none;
    none.fill(kNoIndex);
    graph.neighbour.assign(mesh.cell_count(), none);
    graph.vertex_cell = compute_vertex_cell(mesh);
    FaceClasses classes = classify_faces(mesh, link_equal_faces(mesh, graph, parallel));
    graph.coarse_faces = std::move(classes.coarse);
    graph.fine_faces = std::move(classes.fine);
    for (Index row = 0; row < graph.coarse_faces.size(); ++row) {
        const CellFace coarse = graph.coarse_faces[row];
        graph.neighbour[coarse.cell][coarse.face] = CellGraph::kFine | row;
        for (CellFace fine : graph.fine_faces[row]) graph.neighbour[fine.cell][fine.face] = coarse.cell;
    }
    MiddleSearch(mesh, graph).find();
    link_hanging(mesh, graph);
    return graph;
}

} // namespace hexopt::trimming
