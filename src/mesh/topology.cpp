#include "mesh/topology.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>

namespace hexopt {

namespace {

Csr<CellCorner> compute_vertex_cell(const HexMesh& mesh) {
    Csr<CellCorner> csr;
    csr.offset.assign(mesh.vertex_count() + 1, 0);
    for (const Cell& cell : mesh.cells)
        for (Index v : cell) ++csr.offset[v + 1];
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) csr.offset[v + 1] += csr.offset[v];
    csr.item.resize(csr.offset.back());
    std::vector<std::size_t> next(csr.offset.begin(), csr.offset.end() - 1);
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (std::uint32_t k = 0; k < 8; ++k) csr.item[next[mesh.cells[c][k]]++] = {c, k};
    return csr;
}

struct KeyedFace {
    Quad key; ///< sorted vertices
    CellFace face;
};

std::vector<CellFace> find_faces_used_once(const HexMesh& mesh) {
    std::vector<KeyedFace> faces;
    faces.reserve(mesh.cell_count() * 6);
    for (Index c = 0; c < mesh.cell_count(); ++c)
        for (std::uint32_t f = 0; f < 6; ++f) {
            Quad key = face_vertices(mesh, {c, f});
            std::sort(key.begin(), key.end());
            faces.push_back({key, {c, f}});
        }
    std::sort(faces.begin(), faces.end(), [](const KeyedFace& a, const KeyedFace& b) {
        return a.key != b.key ? a.key < b.key : a.face.cell < b.face.cell;
    });
    std::vector<CellFace> once;
    for (std::size_t i = 0; i < faces.size();) {
        std::size_t end = i + 1;
        while (end < faces.size() && faces[end].key == faces[i].key) ++end;
        if (end == i + 1) once.push_back(faces[i].face);
        i = end;
    }
    std::sort(once.begin(), once.end(),
              [](CellFace a, CellFace b) { return a.cell != b.cell ? a.cell < b.cell : a.face < b.face; });
    return once;
}

} // namespace

Quad face_vertices(const HexMesh& mesh, CellFace face) {
    const auto& local = hex::kFaceVertex[face.face];
    const Cell& cell = mesh.cells[face.cell];
    return {cell[local[0]], cell[local[1]], cell[local[2]], cell[local[3]]};
}

Topology compute_topology(const HexMesh& mesh) {
    Topology topology;
    topology.revision = mesh.revision;
    topology.vertex_cell = compute_vertex_cell(mesh);
    topology.boundary_faces = find_faces_used_once(mesh);
    topology.on_boundary.assign(mesh.vertex_count(), 0);
    for (CellFace face : topology.boundary_faces)
        for (Index v : face_vertices(mesh, face)) topology.on_boundary[v] = 1;
    if (!mesh.hanging.empty()) {
        topology.hanging_row.assign(mesh.vertex_count(), kNoIndex);
        for (std::size_t row = 0; row < mesh.hanging.count(); ++row)
            topology.hanging_row[mesh.hanging.vertex[row]] = static_cast<Index>(row);
    }
    return topology;
}

} // namespace hexopt
