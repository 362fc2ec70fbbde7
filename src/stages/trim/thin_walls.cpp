#include "stages/trim/thin_walls.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <unordered_map>
#include <unordered_set>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kChunk = 64;
constexpr double kMostDropped = 0.25; ///< of the cells of a part of a wall
constexpr double kFacing = 0.5;       ///< cosine between a wall's normal and those of both its sides

class WallSearch {
  public:
    WallSearch(const HexMesh& mesh, const SurfaceQueries& queries, double thinnest_h)
        : mesh_(mesh), queries_(queries), thinnest_h_(thinnest_h) {}

    std::optional<WallCell> look_at(Index cell) const {
        const double h = cell_size(mesh_, cell);
        const Point centre = cell_centre(mesh_, cell);
        const Projection side = queries_.model().project_patch(kNoIndex, centre, kNoIndex);
        const Point& n = side.direction;
        const double across = first_exit(side.point - kContact_h * h * n, -n, h);
        if (!(across <= kThickestWall_h * h)) return std::nullopt;
        // The foot of the centre on the middle, which must be in the wall: not beyond its end.
        const Point half_way = side.point - 0.5 * across * n;
        const Point foot = centre - glm::dot(centre - half_way, n) * n;
        if (!queries_.is_inside(foot)) return std::nullopt;
        const double up = first_exit(foot, n, h), down = first_exit(foot, -n, h);
        const double thickness = up + down;
        if (!(thickness <= kThickestWall_h * h && thickness >= thinnest_h_ * h)) return std::nullopt;
        const WallCell wall{cell, foot + 0.5 * (up - down) * n, n, thickness};
        if (!meets_middle(wall)) return std::nullopt;
        return wall;
    }

  private:
    /// Distance to where the line leaves the inside through a side that faces it; infinite beyond 2 cells.
    double first_exit(const Point& from, const Point& direction, double h) const {
        double nearest = std::numeric_limits<double>::infinity();
        Index triangle = kNoIndex;
        queries_.triangles().visit_line(from, direction, 0, 2 * h, [&](Index t, double at, bool leaving) {
            if (leaving && at < nearest) nearest = at, triangle = t;
        });
        if (triangle == kNoIndex) return nearest;
        const auto& x = queries_.model().triangle(triangle);
        const Point normal = glm::cross(x[1] - x[0], x[2] - x[0]);
        if (glm::dot(normal, direction) < kFacing * glm::length(normal))
            return std::numeric_limits<double>::infinity();
        return nearest;
    }

    /// Corners on both sides of the middle; one on it counts for one side, the same one for all cells.
    bool meets_middle(const WallCell& wall) const {
        Point n = wall.normal;
        for (int k = 2; k >= 0; --k)
            if (std::abs(n[k]) > 1e-6) {
                if (n[k] < 0) n = -n;
                break;
            }
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (Index v : mesh_.cells[wall.cell]) {
            const double d = glm::dot(mesh_.positions[v] - wall.middle, n);
            low = std::min(low, d);
            high = std::max(high, d);
        }
        return low <= 0 && high > 0;
    }

    const HexMesh& mesh_;
    const SurfaceQueries& queries_;
    double thinnest_h_;
};

/// Cells that touch those of the spots, without the kept ones.
std::vector<Index> gather_candidates(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                                     const std::vector<BareSpot>& spots) {
    std::vector<Index> cells, star;
    Index last = kNoIndex;
    for (const BareSpot& spot : spots) {
        if (std::exchange(last, spot.cell) == spot.cell) continue;
        const auto add = [&](Index v) {
            graph.gather_star(v, star);
            cells.insert(cells.end(), star.begin(), star.end());
        };
        for (Index v : mesh.cells[spot.cell]) add(v);
        for (Index v : graph.cell_hanging[spot.cell]) add(v);
    }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    std::erase_if(cells, [&](Index c) { return kept.is_kept(c); });
    return cells;
}

} // namespace

std::vector<WallCell> find_wall_cells(const HexMesh& mesh, const CellGraph& graph, const CellSides& sides,
                                      const KeptCells& kept, const SurfaceQueries& queries,
                                      const std::vector<BareSpot>& spots, double thinnest_h,
                                      const Parallel& parallel) {
    std::vector<Index> cells = gather_candidates(mesh, graph, kept, spots);
    std::erase_if(cells, [&](Index c) { return !sides.cut[c]; });
    const WallSearch search(mesh, queries, thinnest_h);
    std::vector<std::optional<WallCell>> found(cells.size());
    parallel.for_chunks(cells.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) found[i] = search.look_at(cells[i]);
    });
    std::vector<WallCell> walls;
    for (const auto& wall : found)
        if (wall) walls.push_back(*wall);
    return walls;
}

std::size_t drop_frayed_walls(const CellGraph& graph, const KeptCells& kept, std::vector<WallCell>& walls) {
    constexpr Index kUnseen = kNoIndex - 1;
    std::unordered_map<Index, Index> part;
    for (const WallCell& wall : walls) part[wall.cell] = kUnseen;
    std::vector<std::array<std::size_t, 2>> count; // per part: cells, and those dropped
    std::vector<Index> queue;
    for (const WallCell& wall : walls) {
        if (part[wall.cell] != kUnseen) continue;
        queue.assign(1, wall.cell);
        part[wall.cell] = static_cast<Index>(count.size());
        auto& [cells, dropped] = count.emplace_back();
        for (std::size_t i = 0; i < queue.size(); ++i) {
            ++cells;
            dropped += !kept.is_kept(queue[i]);
            for (int f = 0; f < 6; ++f)
                graph.visit_behind(queue[i], f, [&](Index other) {
                    const auto at = part.find(other);
                    if (at == part.end() || at->second != kUnseen) return;
                    at->second = static_cast<Index>(count.size()) - 1;
                    queue.push_back(other);
                });
        }
    }
    const auto is_frayed = [&](const WallCell& wall) {
        const auto& [cells, dropped] = count[part[wall.cell]];
        return static_cast<double>(dropped) > kMostDropped * static_cast<double>(cells);
    };
    return static_cast<std::size_t>(std::erase_if(walls, is_frayed));
}

void spread_over_layers(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                        std::vector<Index>& cells) {
    constexpr double kNoSmaller = 0.9; // sizes are halved from level to level
    std::unordered_set<Index> seen(cells.begin(), cells.end());
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const double least = kNoSmaller * cell_size(mesh, cells[i]);
        for (int f = 0; f < 6; ++f)
            graph.visit_behind(cells[i], f, [&](Index other) {
                if (cell_size(mesh, other) >= least && kept.is_in_layer(other) && seen.insert(other).second)
                    cells.push_back(other);
            });
    }
    std::sort(cells.begin(), cells.end());
}

} // namespace hexopt::trimming
