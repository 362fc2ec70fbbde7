#include "stages/buffer/good_groups.hpp"

#include "quality/cell_quality.hpp"
#include "stages/buffer/buffer_counts.hpp"

namespace hexopt {

namespace {

constexpr double kRightAngle_deg = 90;

bool suits(std::size_t cells, const CurveAngle& angle) {
    const double covered = kRightAngle_deg * static_cast<double>(cells);
    return std::max(angle.largest - covered, covered - angle.smallest) <= kRightAngle_deg / 2;
}

} // namespace

std::vector<std::uint8_t> find_good_groups(const SheetMesh& mesh, const std::vector<Index>& group,
                                           const Domain& domain, const BufferOptions& options,
                                           const Parallel& parallel) {
    const Index count = group.empty() ? 0 : *std::max_element(group.begin(), group.end()) + 1;
    if (options.method != BufferMethod::groups) return std::vector<std::uint8_t>(count, 0);
    std::vector<std::uint8_t> flawed(mesh.positions.size(), 0);
    for (const std::vector<Index>& quads : {find_flat_quads(mesh), find_two_face_quads(mesh)})
        for (Index q : quads)
            for (Index v : mesh.vertices_of(mesh.surface[q].face)) flawed[v] = 1;
    const std::vector<std::size_t> ridge_cells = count_ridge_cells(mesh);
    for (std::size_t r = 0; r < mesh.ridges.size(); ++r)
        if (!suits(ridge_cells[r], domain.angle[mesh.ridges[r].curve]))
            flawed[mesh.ridges[r].a] = flawed[mesh.ridges[r].b] = 1;
    std::vector<std::uint8_t> is_poor(mesh.cells.size());
    parallel.for_each(mesh.cells.size(), 1024, [&](std::size_t c) {
        HexPoints points;
        for (std::size_t k = 0; k < 8; ++k) points[k] = mesh.positions[mesh.cells[c][k]];
        is_poor[c] = !(scaled_jacobian(points) >= options.enough_sj);
    });
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
        if (is_poor[c])
            for (Index v : mesh.cells[c]) flawed[v] = 1;
    std::vector<std::uint8_t> good(count, 1);
    for (const SurfaceQuad& quad : mesh.surface)
        for (Index v : mesh.vertices_of(quad.face))
            if (flawed[v]) good[group[quad.region]] = 0;
    return good;
}

} // namespace hexopt
