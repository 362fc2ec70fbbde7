#include "io/vtu_polyhedra.hpp"

#include "mesh/polyhedral_faces.hpp"

#include <algorithm>

namespace hexopt::io_detail {

namespace {

constexpr char kHexahedron = 12, kPolyhedron = 42;

/// Corners of the cell's faces, seen from its outside.
void append_faces(const PolyhedralFaces& faces, std::span<const std::size_t> cell_faces,
                  PolyhedralCells& out) {
    out.faces.push_back(static_cast<std::int64_t>(cell_faces.size()));
    for (std::size_t entry : cell_faces) {
        const auto polygon = faces.vertices[entry / 2];
        out.faces.push_back(static_cast<std::int64_t>(polygon.size()));
        if (entry % 2 == 0)
            out.faces.insert(out.faces.end(), polygon.begin(), polygon.end());
        else
            out.faces.insert(out.faces.end(), polygon.rbegin(), polygon.rend());
    }
}

} // namespace

Result<PolyhedralCells> make_polyhedral_cells(const HexMesh& mesh, const Context& context) {
    const Topology topology = compute_topology(mesh, context.parallel());
    const auto faces = compute_polyhedral_faces(mesh, topology, context.parallel());
    if (!faces) return faces.error();
    const Csr<std::size_t> cell_face = faces_of_cells(*faces, mesh.cell_count());
    PolyhedralCells out;
    std::vector<Index> corners;
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
        const auto entries = cell_face[c];
        const bool is_hexahedron =
            entries.size() == 6 && std::all_of(entries.begin(), entries.end(),
                                               [&](auto e) { return faces->vertices[e / 2].size() == 4; });
        corners.assign(mesh.cells[c].begin(), mesh.cells[c].end());
        if (!is_hexahedron) {
            for (std::size_t entry : entries)
                for (Index v : faces->vertices[entry / 2]) corners.push_back(v);
            std::sort(corners.begin(), corners.end());
            corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
            append_faces(*faces, entries, out);
        }
        out.connectivity.insert(out.connectivity.end(), corners.begin(), corners.end());
        out.offsets.push_back(static_cast<std::int64_t>(out.connectivity.size()));
        out.types += is_hexahedron ? kHexahedron : kPolyhedron;
        out.face_offsets.push_back(is_hexahedron ? -1 : static_cast<std::int64_t>(out.faces.size()));
    }
    return out;
}

} // namespace hexopt::io_detail
