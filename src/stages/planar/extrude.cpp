#include "stages/planar/extrude.hpp"

#include "mesh/hanging.hpp"

namespace hexopt {

HexMesh extrude(const QuadMesh& mesh, const ExtrudeOptions& options) {
    HexMesh out;
    const auto n = static_cast<Index>(mesh.positions.size());
    for (double z : {options.low, options.high})
        for (const Point2& p : mesh.positions) out.positions.emplace_back(p, z);
    for (const auto& [a, b, c, d] : mesh.quads) out.cells.push_back({a, b, c, d, a + n, b + n, c + n, d + n});
    out.level = mesh.level;
    const Hanging& rows = mesh.hanging;
    for (Index shift : {Index{0}, n})
        for (std::size_t r = 0; r < rows.count(); ++r) {
            std::vector<Index> masters;
            for (std::size_t k = rows.offset[r]; k < rows.offset[r + 1]; ++k)
                masters.push_back(rows.master[k] + shift);
            append_row(out.hanging, rows.vertex[r] + shift, masters,
                       {rows.weight.data() + rows.offset[r], masters.size()});
        }
    out.patch_names = options.wall_names;
    const auto low = static_cast<Index>(out.patch_names.size());
    out.patch_names.push_back(options.low_name);
    out.patch_names.push_back(options.high_name);
    for (const auto& [a, b, patch] : mesh.wall) out.boundary.push_back({{a, b, b + n, a + n}, patch});
    for (const auto& [a, b, c, d] : mesh.quads) {
        out.boundary.push_back({{a, d, c, b}, low});
        out.boundary.push_back({{a + n, b + n, c + n, d + n}, low + 1});
    }
    return out;
}

} // namespace hexopt
