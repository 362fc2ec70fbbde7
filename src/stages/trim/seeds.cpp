#include "stages/trim/seeds.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt::trimming {

namespace {

Error seed_error(const Point& seed, std::string reason) {
    return make_error(ErrorCode::bad_input, "trim",
                      fmt::format("seed ({:.6g}, {:.6g}, {:.6g})", seed.x, seed.y, seed.z),
                      std::move(reason));
}

bool box_holds(const HexMesh& mesh, Index cell, const Point& p) {
    Box box;
    for (Index v : mesh.cells[cell]) box.add(mesh.positions[v]);
    return p.x >= box.low.x && p.y >= box.low.y && p.z >= box.low.z && p.x <= box.high.x &&
           p.y <= box.high.y && p.z <= box.high.z;
}

} // namespace

Result<std::vector<Index>> find_seed_cells(const HexMesh& mesh, std::span<const Point> seeds) {
    std::vector<Index> cells;
    for (const Point& seed : seeds) {
        Index best = kNoIndex;
        double nearest = std::numeric_limits<double>::infinity();
        for (Index c = 0; c < mesh.cell_count(); ++c) {
            if (!box_holds(mesh, c, seed)) continue;
            const double distance = glm::length(cell_centre(mesh, c) - seed);
            if (distance < nearest) nearest = distance, best = c;
        }
        if (best == kNoIndex) return seed_error(seed, "outside the initial mesh");
        cells.push_back(best);
    }
    return cells;
}

Result<WindingRange> choose_side(const SurfaceQueries& queries, std::span<const Point> seeds) {
    WindingRange range;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        const double winding = queries.winding_number(seeds[i]);
        const double whole = std::round(winding);
        const WindingRange own = winding > 0.5 ? WindingRange{} : WindingRange{whole - 0.5, whole + 0.5};
        if (i == 0) range = own;
        if (own.low != range.low)
            return seed_error(seeds[i], "on another side of the surface than the first seed");
    }
    return range;
}

std::vector<Index> find_path_outside(const CellGraph& graph, Index from, std::span<const std::uint8_t> open,
                                     std::span<const std::uint8_t> is_outside) {
    std::vector<Index> reached_from(open.size(), kNoIndex), queue = {from};
    reached_from[from] = from;
    for (std::size_t i = 0; i < queue.size(); ++i) {
        const Index c = queue[i];
        bool outer = false;
        for (int f = 0; f < 6; ++f) {
            outer = outer || graph.is_outer(c, f);
            graph.visit_behind(c, f, [&](Index d) {
                if (!open[d] || reached_from[d] != kNoIndex) return;
                reached_from[d] = c;
                queue.push_back(d);
            });
        }
        if (!outer || !is_outside[c]) continue;
        std::vector<Index> path = {c};
        while (path.back() != from) path.push_back(reached_from[path.back()]);
        std::reverse(path.begin(), path.end());
        return path;
    }
    return {};
}

} // namespace hexopt::trimming
