#include "mesh/polyhedral_faces.hpp"

#include "mesh/constraint_midpoints.hpp"
#include "mesh/face_groups.hpp"

#include <algorithm>
#include <numeric>

namespace hexopt {

namespace {

/// A face of the result: a quad of `seen_from`, on its way to become a polygon seen from the owner.
struct Piece {
    Index owner, neighbour;
    CellFace seen_from;
    auto operator<=>(const Piece&) const = default;
};

Piece make_piece(CellFace face, Index other) {
    return {std::min(face.cell, other), std::max(face.cell, other), face};
}

void append_pairs(const std::vector<KeyedFace>& faces, std::vector<Piece>& pieces) {
    for (std::size_t i = 0; i + 1 < faces.size(); ++i)
        if (faces[i].others == faces[i + 1].others) {
            pieces.push_back(make_piece(faces[i].face, faces[i + 1].face.cell));
            ++i;
        }
}

std::vector<Piece> find_internal(const HexMesh& mesh, const Topology& topology, const Parallel& parallel) {
    constexpr std::size_t kChunk = 8192;
    std::vector<std::vector<Piece>> found((mesh.vertex_count() + kChunk - 1) / kChunk);
    parallel.for_chunks(mesh.vertex_count(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<KeyedFace> faces;
        for (std::size_t v = begin; v < end; ++v) {
            gather_faces(mesh, topology.vertex_cell[v], static_cast<Index>(v), faces);
            append_pairs(faces, found[begin / kChunk]);
        }
    });
    std::vector<Piece> all;
    for (auto& part : found) {
        all.insert(all.end(), part.begin(), part.end());
        part = {};
    }
    for (std::size_t i = 0; i < topology.coarse_faces.size(); ++i)
        for (CellFace fine : topology.fine_faces[i])
            all.push_back(make_piece(fine, topology.coarse_faces[i].cell));
    std::sort(all.begin(), all.end());
    return all;
}

struct QuadPatch {
    Quad sorted;
    Index patch;
};

std::vector<QuadPatch> sort_boundary(const HexMesh& mesh) {
    std::vector<QuadPatch> quads;
    quads.reserve(mesh.boundary.size());
    for (const BoundaryQuad& quad : mesh.boundary) {
        quads.push_back({quad.vertices, quad.patch});
        std::sort(quads.back().sorted.begin(), quads.back().sorted.end());
    }
    std::sort(quads.begin(), quads.end(), [](const QuadPatch& a, const QuadPatch& b) {
        return std::tie(a.sorted, a.patch) < std::tie(b.sorted, b.patch);
    });
    return quads;
}

/// Patch of every boundary face; the number of patches where it has none.
std::vector<Index> patches_of(const HexMesh& mesh, const Topology& topology) {
    const std::vector<QuadPatch> quads = sort_boundary(mesh);
    const Index none = static_cast<Index>(mesh.patch_names.size());
    std::vector<Index> patches;
    patches.reserve(topology.boundary_faces.size());
    for (CellFace face : topology.boundary_faces) {
        Quad key = face_vertices(mesh, face);
        std::sort(key.begin(), key.end());
        const auto at = std::lower_bound(quads.begin(), quads.end(), key,
                                         [](const QuadPatch& q, const Quad& k) { return q.sorted < k; });
        const bool is_named = at != quads.end() && at->sorted == key && at->patch < none;
        patches.push_back(is_named ? at->patch : none);
    }
    return patches;
}

/// Puts hanging vertices on the edges of quads.
class EdgeSplitter {
  public:
    explicit EdgeSplitter(const HexMesh& mesh) : midpoints_(mesh), is_near_(mesh.vertex_count(), 0) {
        for (Index v : mesh.hanging.vertex) is_near_[v] = 1;
        for (Index v : mesh.hanging.master) is_near_[v] = 1;
    }
    void append(const Quad& quad, std::vector<Index>& polygon) const {
        for (std::size_t k = 0; k < 4; ++k) {
            polygon.push_back(quad[k]);
            append_between(quad[k], quad[(k + 1) % 4], kDeepest, polygon);
        }
    }

  private:
    static constexpr int kDeepest = 8;

    void append_between(Index from, Index to, int depth, std::vector<Index>& polygon) const {
        if (depth == 0 || !is_near_[from] || !is_near_[to]) return;
        std::vector<Index> found;
        midpoints_.find(from, to, found);
        if (found.empty()) return;
        append_between(from, found.front(), depth - 1, polygon);
        polygon.push_back(found.front());
        append_between(found.front(), to, depth - 1, polygon);
    }

    ConstraintMidpoints midpoints_;
    std::vector<std::uint8_t> is_near_;
};

/// A polygon for every piece, in chunks so that the result does not depend on the threads.
void append_polygons(const HexMesh& mesh, const std::vector<Piece>& pieces, const EdgeSplitter& splitter,
                     const Parallel& parallel, Csr<Index>& polygons) {
    constexpr std::size_t kChunk = 16384;
    std::vector<Csr<Index>> parts((pieces.size() + kChunk - 1) / kChunk);
    parallel.for_chunks(pieces.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        Csr<Index>& part = parts[begin / kChunk];
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t start = part.item.size();
            splitter.append(face_vertices(mesh, pieces[i].seen_from), part.item);
            if (pieces[i].seen_from.cell != pieces[i].owner)
                std::reverse(part.item.begin() + static_cast<std::ptrdiff_t>(start), part.item.end());
            part.offset.push_back(part.item.size());
        }
    });
    for (Csr<Index>& part : parts) {
        const std::size_t before = polygons.item.size();
        polygons.item.insert(polygons.item.end(), part.item.begin(), part.item.end());
        for (std::size_t i = 1; i < part.offset.size(); ++i)
            polygons.offset.push_back(before + part.offset[i]);
        part = {};
    }
}

/// A cell whose edges are not each used by two faces in opposite senses, or kNoIndex.
Index find_open_cell(const PolyhedralFaces& faces, std::size_t cell_count, const Parallel& parallel) {
    const Csr<std::size_t> cell_face = faces_of_cells(faces, cell_count);
    std::vector<std::uint8_t> is_open(cell_count, 0);
    parallel.for_chunks(cell_count, 4096, [&](std::size_t begin, std::size_t end) {
        std::vector<std::array<Index, 2>> edges, reversed;
        for (std::size_t c = begin; c < end; ++c) {
            edges.clear();
            reversed.clear();
            for (std::size_t entry : cell_face[c]) {
                const auto polygon = faces.vertices[entry / 2];
                for (std::size_t k = 0; k < polygon.size(); ++k) {
                    std::array<Index, 2> edge = {polygon[k], polygon[(k + 1) % polygon.size()]};
                    if (entry % 2 == 1) std::swap(edge[0], edge[1]);
                    edges.push_back(edge);
                    reversed.push_back({edge[1], edge[0]});
                }
            }
            std::sort(edges.begin(), edges.end());
            std::sort(reversed.begin(), reversed.end());
            is_open[c] = edges != reversed || std::adjacent_find(edges.begin(), edges.end()) != edges.end();
        }
    });
    const auto at = std::find(is_open.begin(), is_open.end(), 1);
    return at == is_open.end() ? kNoIndex : static_cast<Index>(at - is_open.begin());
}

std::vector<Piece> order_boundary(const HexMesh& mesh, const Topology& topology, PolyhedralFaces& faces) {
    const std::vector<Index> patch = patches_of(mesh, topology);
    faces.patch_names = mesh.patch_names;
    if (std::find(patch.begin(), patch.end(), faces.patch_names.size()) != patch.end())
        faces.patch_names.emplace_back("boundary");
    std::vector<std::size_t> order(patch.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return patch[a] < patch[b]; });
    std::vector<Piece> pieces;
    pieces.reserve(order.size());
    std::vector<std::size_t> count(faces.patch_names.size(), 0);
    for (std::size_t i : order) {
        const CellFace face = topology.boundary_faces[i];
        pieces.push_back({face.cell, kNoIndex, face});
        ++count[patch[i]];
    }
    faces.patch_start.assign(1, faces.internal_count());
    for (std::size_t n : count) faces.patch_start.push_back(faces.patch_start.back() + n);
    return pieces;
}

} // namespace

Csr<std::size_t> faces_of_cells(const PolyhedralFaces& faces, std::size_t cell_count) {
    Csr<std::size_t> csr;
    csr.offset.assign(cell_count + 1, 0);
    for (Index c : faces.owner) ++csr.offset[c];
    for (Index c : faces.neighbour) ++csr.offset[c];
    std::size_t end = 0;
    for (std::size_t& offset : csr.offset) offset = end += offset;
    csr.item.resize(end);
    for (std::size_t f = faces.count(); f-- > 0;) {
        if (f < faces.internal_count()) csr.item[--csr.offset[faces.neighbour[f]]] = 2 * f + 1;
        csr.item[--csr.offset[faces.owner[f]]] = 2 * f;
    }
    return csr;
}

Result<PolyhedralFaces> compute_polyhedral_faces(const HexMesh& mesh, const Topology& topology,
                                                 const Parallel& parallel) {
    PolyhedralFaces faces;
    const EdgeSplitter splitter(mesh);
    const std::vector<Piece> internal = find_internal(mesh, topology, parallel);
    for (const Piece& piece : internal) {
        faces.owner.push_back(piece.owner);
        faces.neighbour.push_back(piece.neighbour);
    }
    append_polygons(mesh, internal, splitter, parallel, faces.vertices);
    const std::vector<Piece> boundary = order_boundary(mesh, topology, faces);
    for (const Piece& piece : boundary) faces.owner.push_back(piece.owner);
    append_polygons(mesh, boundary, splitter, parallel, faces.vertices);
    if (const Index cell = find_open_cell(faces, mesh.cell_count(), parallel); cell != kNoIndex)
        return Error{ErrorCode::bad_input,
                     "faces",
                     "cell " + std::to_string(cell),
                     {"its faces do not close with the hanging vertices of its neighbours",
                      "two hanging vertices have the same constraint, or one is missing"}};
    return faces;
}

} // namespace hexopt
