#include "mesh/topology.hpp"

#include "mesh/constraint_midpoints.hpp"
#include "mesh/face_groups.hpp"
#include "mesh/face_split.hpp"
#include "mesh/hanging.hpp"

#include <algorithm>

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
