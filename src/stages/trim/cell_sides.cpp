#include "stages/trim/cell_sides.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kBlock = 64; ///< cells in a row are near one another
constexpr std::size_t kChunk = 16; ///< blocks

using Corners = std::array<Point, 8>;

Corners cell_corners(const HexMesh& mesh, Index cell) {
    Corners x;
    for (int k = 0; k < 8; ++k) x[k] = mesh.positions[mesh.cells[cell][k]];
    return x;
}

Box box_of(std::span<const Point> points) {
    Box box;
    for (const Point& p : points) box.add(p);
    return box;
}

bool is_box(const Corners& x) {
    for (int k = 0; k < 8; ++k) {
        const Point expected(hex::kVertexX[k] ? x[6].x : x[0].x, hex::kVertexY[k] ? x[6].y : x[0].y,
                             hex::kVertexZ[k] ? x[6].z : x[0].z);
        if (x[k] != expected) return false;
    }
    return true;
}

/// Tells whether triangles touch a cell by separating axes: exact for boxes; for other hexahedra some that
/// come near are taken to touch.
class CutTest {
  public:
    explicit CutTest(const Corners& x) : x_(x), box_(is_box(x)) {
        if (box_) {
            edges_ = {Point(1, 0, 0), Point(0, 1, 0), Point(0, 0, 1)};
        } else {
            for (const auto& e : hex::kEdgeVertex) edges_.push_back(x[e[1]] - x[e[0]]);
            for (const auto& f : hex::kFaceVertex)
                normals_.push_back(glm::cross(x[f[2]] - x[f[0]], x[f[3]] - x[f[1]]));
        }
    }

    bool touches(const std::array<Point, 3>& t) const {
        const std::array<Point, 3> side = {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
        if (separates(glm::cross(side[0], side[1]), t)) return false;
        for (const Point& normal : normals_)
            if (separates(normal, t)) return false;
        for (const Point& edge : edges_)
            for (const Point& s : side)
                if (separates(glm::cross(edge, s), t)) return false;
        return true;
    }

  private:
    bool separates(const Point& axis, const std::array<Point, 3>& t) const {
        double low = 0, high = 0;
        if (box_) {
            for (int k = 0; k < 3; ++k) {
                const double a = axis[k] * (x_[0][k] - t[0][k]), b = axis[k] * (x_[6][k] - t[0][k]);
                low += std::min(a, b);
                high += std::max(a, b);
            }
        } else {
            low = high = glm::dot(axis, x_[0] - t[0]);
            for (int k = 1; k < 8; ++k) {
                const double d = glm::dot(axis, x_[k] - t[0]);
                low = std::min(low, d);
                high = std::max(high, d);
            }
        }
        const double b = glm::dot(axis, t[1] - t[0]), c = glm::dot(axis, t[2] - t[0]);
        const double slack = 1e-9 * (high - low);
        return std::max({0.0, b, c}) < low - slack || std::min({0.0, b, c}) > high + slack;
    }

    const Corners& x_;
    bool box_;
    std::vector<Point> edges_, normals_;
};

/// A triangle that touches the cell, or kNoIndex.
Index find_cutting_triangle(const Corners& x, const TriangleTree& tree) {
    const CutTest test(x);
    Index found = kNoIndex;
    tree.visit_box(box_of(x), [&](Index t, const TriangleTree::Corners& corners) {
        if (test.touches(corners)) found = t;
        return found != kNoIndex;
    });
    return found;
}

void measure_cut_cell(const HexMesh& mesh, const SurfaceQueries& queries, Index c, Index triangle,
                      TrimMemory::Side& side) {
    const Point centre = cell_centre(mesh, c);
    const Projection nearest = queries.model().project_patch(kNoIndex, centre, triangle);
    const double h = cell_size(mesh, c);
    double depth_h = nearest.distance / h;
    side.cut = true;
    side.inside = queries.is_inside(centre);
    // The surface is nothing to keep away from where the inside goes on behind it.
    if (side.inside && depth_h < 0.5 && queries.is_inside_beyond(centre, nearest, kContact_h * h))
        depth_h = 1;
    side.depth_h = static_cast<float>(side.inside ? depth_h : -depth_h);
}

/// Looks at those of a run of cells that are not known.
void find_cut_among(const HexMesh& mesh, const SurfaceQueries& queries, Index first, Index last,
                    TrimMemory& memory) {
    Box box;
    for (Index c = first; c < last; ++c)
        if (!memory.side(c).known)
            for (Index v : mesh.cells[c]) box.add(mesh.positions[v]);
    const auto any = [](Index, const TriangleTree::Corners&) { return true; };
    const bool none = !queries.triangles().visit_box(box, any);
    for (Index c = first; c < last; ++c) {
        TrimMemory::Side& side = memory.side(c);
        if (std::exchange(side.known, true) || none) continue;
        const Index triangle = find_cutting_triangle(cell_corners(mesh, c), queries.triangles());
        if (triangle != kNoIndex) measure_cut_cell(mesh, queries, c, triangle, side);
    }
}

void find_cut_cells(const HexMesh& mesh, const SurfaceQueries& queries, Context& context, CellSides& sides,
                    TrimMemory& memory) {
    const std::size_t blocks = (mesh.cell_count() + kBlock - 1) / kBlock;
    context.parallel().for_each(blocks, kChunk, [&](std::size_t block) {
        if (context.is_cancelled()) return;
        const auto first = static_cast<Index>(block * kBlock);
        const auto last = static_cast<Index>(std::min(mesh.cell_count(), first + kBlock));
        find_cut_among(mesh, queries, first, last, memory);
        for (Index c = first; c < last; ++c) {
            const TrimMemory::Side& side = memory.side(c);
            sides.cut[c] = side.cut;
            if (!side.cut) continue;
            sides.inside[c] = side.inside;
            sides.depth_h[c] = side.depth_h;
        }
    });
}

/// Members of each region by rising cell.
Csr<Index> fill_regions(const CellGraph& graph, CellSides& sides) {
    Csr<Index> members;
    sides.region.assign(sides.cut.size(), kNoIndex);
    for (Index seed = 0; seed < sides.cut.size(); ++seed) {
        if (sides.cut[seed] || sides.region[seed] != kNoIndex) continue;
        const Index region = sides.region_count++;
        sides.region[seed] = region;
        const std::size_t first = members.item.size();
        members.item.push_back(seed);
        for (std::size_t i = first; i < members.item.size(); ++i) // the list is the queue
            for (int f = 0; f < 6; ++f) {
                const Index c = members.item[i];
                graph.visit_behind(c, f, [&](Index d) {
                    if (sides.cut[d] || sides.region[d] != kNoIndex) return;
                    sides.region[d] = region;
                    members.item.push_back(d);
                });
            }
        members.offset.push_back(members.item.size());
    }
    return members;
}

/// Decides regions by a few of their cells, or all of them one by one where those disagree.
class RegionVote {
  public:
    RegionVote(const HexMesh& mesh, const CellGraph& graph, const SurfaceQueries& queries, CellSides& sides,
               TrimMemory& memory)
        : mesh_(mesh), graph_(graph), queries_(queries), sides_(sides), memory_(memory) {}

    void decide(std::span<const Index> members, const Parallel& parallel) {
        std::vector<Index> asked;
        for (std::size_t i = 0; i < 5; ++i) asked.push_back(members[i * (members.size() - 1) / 4]);
        if (!queries_.is_closed())
            for (Index c : members)
                if (is_beside_cut(c)) asked.push_back(c);
        std::sort(asked.begin(), asked.end());
        asked.erase(std::unique(asked.begin(), asked.end()), asked.end());
        const std::size_t yes = ask(asked, parallel);
        if (yes == 0 || yes == asked.size()) {
            for (Index c : members) sides_.inside[c] = yes > 0;
        } else {
            ask(members, parallel);
            sides_.uncertain_cells += members.size();
        }
        for (Index c : members) sides_.depth_h[c] = sides_.inside[c] ? 1.0f : -1.0f;
    }

  private:
    bool is_beside_cut(Index c) const {
        bool beside = false;
        for (int f = 0; f < 6; ++f)
            graph_.visit_behind(c, f, [&](Index d) { beside = beside || sides_.cut[d]; });
        return beside;
    }

    std::size_t ask(std::span<const Index> cells, const Parallel& parallel) {
        return parallel.reduce<std::size_t>(
            cells.size(), 256, 0,
            [&](std::size_t begin, std::size_t end) {
                std::size_t yes = 0;
                for (std::size_t i = begin; i < end; ++i) {
                    const bool inside = is_inside(cells[i]);
                    sides_.inside[cells[i]] = inside;
                    yes += inside;
                }
                return yes;
            },
            std::plus<>());
    }

    bool is_inside(Index cell) const {
        TrimMemory::Side& side = memory_.side(cell);
        if (!side.side_known) side.inside = queries_.is_inside(cell_centre(mesh_, cell));
        side.side_known = true;
        return side.inside;
    }

    const HexMesh& mesh_;
    const CellGraph& graph_;
    const SurfaceQueries& queries_;
    CellSides& sides_;
    TrimMemory& memory_;
};

/// Mean edge length in each direction.
std::array<double, 3> mean_edges(const HexMesh& mesh, Index cell) {
    std::array<double, 3> length = {0, 0, 0};
    const Cell& v = mesh.cells[cell];
    for (std::size_t e = 0; e < 12; ++e) {
        const auto& edge = hex::kEdgeVertex[e];
        length[e / 4] += glm::length(mesh.positions[v[edge[1]]] - mesh.positions[v[edge[0]]]) / 4;
    }
    return length;
}

} // namespace

Point cell_centre(const HexMesh& mesh, Index cell) {
    Point sum(0);
    for (Index v : mesh.cells[cell]) sum += mesh.positions[v];
    return sum / 8.0;
}

double cell_size(const HexMesh& mesh, Index cell) {
    const auto length = mean_edges(mesh, cell);
    return std::min({length[0], length[1], length[2]});
}

double cell_volume(const HexMesh& mesh, Index cell) {
    const auto length = mean_edges(mesh, cell);
    return length[0] * length[1] * length[2];
}

CellSides find_sides(const HexMesh& mesh, const CellGraph& graph, const SurfaceQueries& queries,
                     Context& context, TrimMemory& memory) {
    CellSides sides;
    sides.cut.assign(mesh.cell_count(), 0);
    sides.inside.assign(mesh.cell_count(), 0);
    sides.depth_h.assign(mesh.cell_count(), -1);
    find_cut_cells(mesh, queries, context, sides, memory);
    if (context.is_cancelled()) return sides;
    const Csr<Index> members = fill_regions(graph, sides);
    RegionVote vote(mesh, graph, queries, sides, memory);
    for (Index r = 0; r < sides.region_count && !context.is_cancelled(); ++r)
        vote.decide(members[r], context.parallel());
    return sides;
}

} // namespace hexopt::trimming
