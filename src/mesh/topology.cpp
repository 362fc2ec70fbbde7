#include "mesh/topology.hpp"

#include "mesh/face_groups.hpp"
#include "mesh/face_split.hpp"
#include "mesh/hanging.hpp"

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

void append_used_once(const std::vector<KeyedFace>& faces, std::vector<CellFace>& once) {
    for (std::size_t i = 0; i < faces.size();) {
        std::size_t end = i + 1;
        while (end < faces.size() && faces[end].others == faces[i].others) ++end;
        if (end == i + 1) once.push_back(faces[i].face);
        i = end;
    }
}

/// Finds the vertices in the middle of an edge by comparing what they depend on, not where they are.
class ConstraintMidpoints {
  public:
    explicit ConstraintMidpoints(const HexMesh& mesh)
        : hanging_(mesh.hanging), row_of_(compute_hanging_row(mesh.hanging, mesh.vertex_count())),
          order_(mesh.hanging.count()) {
        for (Index row = 0; row < order_.size(); ++row) order_[row] = row;
        std::sort(order_.begin(), order_.end(), [&](Index a, Index b) {
            const auto x = masters(a), y = masters(b);
            return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
        });
    }

    void find(Index from, Index to, std::vector<Index>& found) const {
        std::vector<Index> ids;
        std::vector<double> weights;
        merge_halves(from, to, ids, weights);
        const auto less = [&](Index row, const std::vector<Index>& key) {
            const auto x = masters(row);
            return std::lexicographical_compare(x.begin(), x.end(), key.begin(), key.end());
        };
        for (auto it = std::lower_bound(order_.begin(), order_.end(), ids, less); it != order_.end(); ++it) {
            const auto x = masters(*it);
            if (!std::equal(x.begin(), x.end(), ids.begin(), ids.end())) break;
            const double* w = hanging_.weight.data() + hanging_.offset[*it];
            if (std::equal(weights.begin(), weights.end(), w, is_close))
                found.push_back(hanging_.vertex[*it]);
        }
    }

  private:
    static bool is_close(double a, double b) { return std::abs(a - b) < 1e-6; }

    std::span<const Index> masters(Index row) const {
        return {hanging_.master.data() + hanging_.offset[row],
                hanging_.offset[row + 1] - hanging_.offset[row]};
    }

    void append_half(Index v, std::vector<std::pair<Index, double>>& terms) const {
        const Index row = row_of_[v];
        if (row == kNoIndex) return terms.emplace_back(v, 0.5), void();
        for (std::size_t k = hanging_.offset[row]; k < hanging_.offset[row + 1]; ++k)
            terms.emplace_back(hanging_.master[k], hanging_.weight[k] / 2);
    }

    void merge_halves(Index from, Index to, std::vector<Index>& ids, std::vector<double>& weights) const {
        std::vector<std::pair<Index, double>> terms;
        append_half(from, terms);
        append_half(to, terms);
        std::stable_sort(terms.begin(), terms.end(), [](auto a, auto b) { return a.first < b.first; });
        for (auto [id, weight] : terms) {
            if (!ids.empty() && ids.back() == id)
                weights.back() += weight;
            else
                ids.push_back(id), weights.push_back(weight);
        }
    }

    const Hanging& hanging_;
    std::vector<Index> row_of_;
    std::vector<Index> order_; ///< rows sorted by their masters
};

constexpr int kMaxCuts = 8;

} // namespace

Csr<CellCorner> compute_vertex_cell(const HexMesh& mesh) {
    Csr<CellCorner> csr;
    csr.offset.assign(mesh.vertex_count() + 1, 0);
    for (const Cell& cell : mesh.cells)
        for (Index v : cell) ++csr.offset[v];
    std::size_t end = 0;
    for (std::size_t& offset : csr.offset) offset = end += offset;
    csr.item.resize(end);
    // Filling from the last cell backwards turns the ends of the rows into their starts.
    for (Index c = static_cast<Index>(mesh.cell_count()); c-- > 0;)
        for (std::uint32_t k = 8; k-- > 0;) csr.item[--csr.offset[mesh.cells[c][k]]] = {c, k};
    return csr;
}

std::vector<CellFace> find_faces_used_once(const HexMesh& mesh, const Csr<CellCorner>& vertex_cell,
                                           const Parallel& parallel) {
    constexpr std::size_t kChunk = 8192;
    std::vector<std::vector<CellFace>> once((mesh.vertex_count() + kChunk - 1) / kChunk);
    parallel.for_chunks(mesh.vertex_count(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<KeyedFace> faces;
        for (std::size_t v = begin; v < end; ++v) {
            gather_faces(mesh, vertex_cell[v], static_cast<Index>(v), faces);
            append_used_once(faces, once[begin / kChunk]);
        }
    });
    std::vector<CellFace> all;
    for (const auto& part : once) all.insert(all.end(), part.begin(), part.end());
    std::sort(all.begin(), all.end());
    return all;
}

FaceClasses classify_faces(const HexMesh& mesh, std::span<const CellFace> used_once) {
    FaceClasses classes;
    if (mesh.hanging.empty()) {
        classes.boundary.assign(used_once.begin(), used_once.end());
        return classes;
    }
    std::vector<Quad> quads;
    quads.reserve(used_once.size());
    for (CellFace face : used_once) quads.push_back(face_vertices(mesh, face));
    const FaceSplitter splitter(std::move(quads));
    const ConstraintMidpoints midpoints(mesh);
    const MidpointFinder finder = [&](Index from, Index to, std::vector<Index>& found) {
        midpoints.find(from, to, found);
    };
    std::vector<std::uint8_t> between(used_once.size(), 0);
    FaceCover cover;
    for (Index face = 0; face < used_once.size(); ++face) {
        if (between[face] || !splitter.cover(face, finder, kMaxCuts, cover)) continue;
        between[face] = 1;
        classes.coarse.push_back(used_once[face]);
        for (Index part : cover.parts) {
            between[part] = 1;
            classes.fine.item.push_back(used_once[part]);
        }
        classes.fine.offset.push_back(classes.fine.item.size());
    }
    for (Index face = 0; face < used_once.size(); ++face)
        if (!between[face]) classes.boundary.push_back(used_once[face]);
    return classes;
}

Quad face_vertices(const HexMesh& mesh, CellFace face) {
    const auto& local = hex::kFaceVertex[face.face];
    const Cell& cell = mesh.cells[face.cell];
    return {cell[local[0]], cell[local[1]], cell[local[2]], cell[local[3]]};
}

Topology compute_topology(const HexMesh& mesh, const Parallel& parallel) {
    Topology topology;
    topology.revision = mesh.revision;
    topology.vertex_cell = compute_vertex_cell(mesh);
    topology.hanging_row = compute_hanging_row(mesh.hanging, mesh.vertex_count());
    FaceClasses classes = classify_faces(mesh, find_faces_used_once(mesh, topology.vertex_cell, parallel));
    topology.boundary_faces = std::move(classes.boundary);
    topology.coarse_faces = std::move(classes.coarse);
    topology.fine_faces = std::move(classes.fine);
    topology.on_boundary.assign(mesh.vertex_count(), 0);
    for (CellFace face : topology.boundary_faces)
        for (Index v : face_vertices(mesh, face)) topology.on_boundary[v] = 1;
    return topology;
}

} // namespace hexopt
