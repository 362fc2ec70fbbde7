#include "render/visible_faces.hpp"

#include <algorithm>

namespace hexopt {

namespace {

using Faces = std::vector<VisibleFace>;

bool has_vertices(const Cell& cell, const Quad& quad) {
    return std::all_of(quad.begin(), quad.end(),
                       [&](Index v) { return std::find(cell.begin(), cell.end(), v) != cell.end(); });
}

/// Whether a cell that is left out lists the same four vertices.
bool borders_on_left_out(const HexMesh& mesh, const Topology& topology, CellFace face,
                         const std::vector<std::uint8_t>& keep) {
    const Quad quad = face_vertices(mesh, face);
    for (const CellCorner& candidate : topology.vertex_cell[quad[0]])
        if (!keep[candidate.cell] && has_vertices(mesh.cells[candidate.cell], quad)) return true;
    return false;
}

Faces faces_between_equals(const HexMesh& mesh, const Topology& topology,
                           const std::vector<std::uint8_t>& keep, const Parallel& parallel) {
    return parallel.reduce(
        mesh.cell_count(), 4096, Faces{},
        [&](std::size_t begin, std::size_t end) {
            Faces faces;
            for (std::size_t c = begin; c < end; ++c)
                for (std::uint32_t f = 0; keep[c] && f < 6; ++f) {
                    const CellFace face{static_cast<Index>(c), f};
                    if (borders_on_left_out(mesh, topology, face, keep)) faces.push_back({face, true});
                }
            return faces;
        },
        [](Faces all, const Faces& part) {
            all.insert(all.end(), part.begin(), part.end());
            return all;
        });
}

void add_faces_between_levels(Faces& faces, const Topology& topology, const std::vector<std::uint8_t>& keep) {
    for (std::size_t i = 0; i < topology.coarse_faces.size(); ++i) {
        const CellFace coarse = topology.coarse_faces[i];
        bool all_fine_kept = true;
        for (CellFace fine : topology.fine_faces[i]) {
            all_fine_kept = all_fine_kept && keep[fine.cell];
            if (keep[fine.cell] && !keep[coarse.cell]) faces.push_back({fine, true});
        }
        if (keep[coarse.cell] && !all_fine_kept) faces.push_back({coarse, true});
    }
}

} // namespace

std::vector<VisibleFace> find_visible_faces(const HexMesh& mesh, const Topology& topology,
                                            const std::vector<std::uint8_t>& keep, const Parallel& parallel) {
    Faces faces;
    if (!keep.empty()) {
        faces = faces_between_equals(mesh, topology, keep, parallel);
        add_faces_between_levels(faces, topology, keep);
    }
    for (CellFace face : topology.boundary_faces)
        if (keep.empty() || keep[face.cell]) faces.push_back({face, false});
    std::sort(faces.begin(), faces.end(),
              [](const VisibleFace& a, const VisibleFace& b) { return a.face < b.face; });
    return faces;
}

} // namespace hexopt
