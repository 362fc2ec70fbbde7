#include "stages/optimize/boundary_contacts.hpp"

namespace hexopt {

BoundaryContacts::BoundaryContacts(const HexMesh& mesh, const Topology& topology, ContactLimits limits) {
    vertex_quad_.offset.assign(mesh.vertex_count() + 1, 0);
    for (CellFace face : topology.boundary_faces) {
        quads_.push_back(face_vertices(mesh, face));
        for (Index v : quads_.back()) ++vertex_quad_.offset[v + 1];
    }
    for (Index v = 0; v < mesh.vertex_count(); ++v) vertex_quad_.offset[v + 1] += vertex_quad_.offset[v];
    vertex_quad_.item.resize(vertex_quad_.offset.back());
    std::vector<std::size_t> next(vertex_quad_.offset.begin(), vertex_quad_.offset.end() - 1);
    for (Index q = 0; q < quads_.size(); ++q)
        for (Index v : quads_[q]) vertex_quad_.item[next[v]++] = q;
    guard_ = std::make_unique<ContactGuard>(mesh, topology, quads_, vertex_quad_, limits);
}

std::vector<Index> BoundaryContacts::quads_with(std::span<const std::uint8_t> vertex_flag) const {
    std::vector<Index> found;
    for (Index q = 0; q < quads_.size(); ++q)
        for (Index v : quads_[q])
            if (vertex_flag[v]) {
                found.push_back(q);
                break;
            }
    return found;
}

} // namespace hexopt
