#include "mesh/canonical_form.hpp"

#include "core/morton.hpp"
#include "core/random.hpp"
#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"
#include "mesh/tight_box.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numeric>
#include <tuple>
#include <unordered_map>

namespace hexopt {

namespace {

constexpr int kLabelRounds = 4, kLabelMoments = 4;
/// Moments below this share of their largest possible value point nowhere in particular.
constexpr double kLeastMoment = 3e-5;
/// The grid's width: of the shortest cell, and of the mesh's extent; at least the last, of that.
constexpr double kGridOfCell = 0x1p-16, kCoarsestGrid = 0x1p-26, kFinestGrid = 0x1p-38;
/// Keeps lengths that are powers of two, and places halfway between two of the grid, off the decision.
constexpr double kOffTies = 0.7236067977;

using Label = std::uint64_t;

/// Corners of a cell at 1, 2 and 3 edges from each.
constexpr auto kAtDistance = [] {
    std::array<std::array<std::uint8_t, 7>, 8> at{};
    for (int k = 0; k < 8; ++k) {
        const auto place = [](int v) {
            return hex::kVertexX[v] | hex::kVertexY[v] << 1 | hex::kVertexZ[v] << 2;
        };
        int count = 0;
        for (int distance = 1; distance <= 3; ++distance)
            for (int other = 0; other < 8; ++other)
                if (std::popcount(static_cast<unsigned>(place(k) ^ place(other))) == distance)
                    at[k][count++] = static_cast<std::uint8_t>(other);
    }
    return at;
}();

/// What the cells round each vertex look like, four rings far: a hash that does not know numbers, after
/// Weisfeiler and Leman 1968.
std::vector<Label> label_vertices(const HexMesh& mesh, const Topology& topology, const Parallel& parallel) {
    std::vector<Label> label(mesh.vertex_count()), next(mesh.vertex_count());
    for (Index v = 0; v < label.size(); ++v) {
        const bool hangs = !topology.hanging_row.empty() && topology.hanging_row[v] != kNoIndex;
        label[v] = mix_bits(4 * topology.vertex_cell[v].size() + 2 * topology.on_boundary[v] + hangs);
    }
    for (int round = 0; round < kLabelRounds; ++round) {
        parallel.for_each(mesh.vertex_count(), 1024, [&](std::size_t v) {
            Label sum = 0;
            for (CellCorner at : topology.vertex_cell[v]) {
                const Cell& cell = mesh.cells[at.cell];
                const auto& other = kAtDistance[at.corner];
                const auto of = [&](int i) { return label[cell[other[i]]]; };
                sum += mix_bits(of(0) + of(1) + of(2) + mix_bits(of(3) + of(4) + of(5) + mix_bits(of(6))));
            }
            next[v] = mix_bits(label[v] + sum);
        });
        label.swap(next);
    }
    return label;
}

using Sum = glm::tvec3<long double>;

/// Mean of weight(v) times the offset of v, over the vertices that cells use.
template <class Weight>
Point mean_of(const HexMesh& mesh, const Topology& topology, const Point& centre, Weight weight) {
    Sum sum(0);
    std::size_t count = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        if (topology.vertex_cell[v].empty()) continue;
        sum += static_cast<long double>(weight(v)) * Sum(mesh.positions[v] - centre);
        ++count;
    }
    return Point(sum / static_cast<long double>(std::max<std::size_t>(1, count)));
}

/// -1..1
double weight_of(Label label, int which) {
    return static_cast<double>(mix_bits(label + static_cast<Label>(which)) >> 11) * 0x1p-52 - 1;
}

Point perpendicular(const Point& v, const Point& unit) { return v - glm::dot(v, unit) * unit; }

Point longest_of(const std::vector<Point>& vectors) {
    return *std::max_element(vectors.begin(), vectors.end(),
                             [](const Point& a, const Point& b) { return glm::dot(a, a) < glm::dot(b, b); });
}

/// Means of the offsets over the vertices of each label, weighted by these: large where few vertices tell
/// the ways round a shape apart.
std::vector<Point> label_moments(const HexMesh& mesh, const Topology& topology,
                                 const std::vector<Label>& label, const Point& centre) {
    std::vector<std::pair<Label, Index>> by_label;
    for (Index v = 0; v < label.size(); ++v)
        if (!topology.vertex_cell[v].empty()) by_label.emplace_back(label[v], v);
    std::sort(by_label.begin(), by_label.end());
    std::vector<Sum> moments(kLabelMoments, Sum(0));
    std::size_t labels = 0;
    for (std::size_t begin = 0, end = 0; begin < by_label.size(); begin = end, ++labels) {
        Sum sum(0);
        for (; end < by_label.size() && by_label[end].first == by_label[begin].first; ++end)
            sum += Sum(mesh.positions[by_label[end].second] - centre);
        sum /= static_cast<long double>(end - begin);
        for (int which = 0; which < kLabelMoments; ++which)
            moments[which] += static_cast<long double>(weight_of(by_label[begin].first, which)) * sum;
    }
    std::vector<Point> means;
    for (const Sum& sum : moments)
        means.emplace_back(sum / static_cast<long double>(std::max<std::size_t>(1, labels)));
    return means;
}

/// An offset across the unit vector `axis` (zero: any) of a vertex that looks like fewest others and of these
/// lies far out; which of several that lie equally far is immaterial, as the mesh is symmetric then. Zero
/// where all lie on the axis.
Point find_outlier(const HexMesh& mesh, const Topology& topology, const std::vector<Label>& label,
                   const Point& centre, double size, const Point& axis) {
    std::unordered_map<Label, std::size_t> count;
    for (Label l : label) ++count[l];
    Point farthest(0);
    auto best = std::tuple(~std::size_t{0}, Label{0}, 0.0); // least
    for (Index v = 0; v < label.size(); ++v) {
        const Point offset = mesh.positions[v] - centre, across = perpendicular(offset, axis);
        if (topology.vertex_cell[v].empty() || !(glm::length(across) > kLeastMoment * size)) continue;
        const double length = glm::length(across) + 0.3 * glm::dot(offset, axis);
        if (const auto key = std::tuple(count[label[v]], label[v], -length); key < best)
            best = key, farthest = across;
    }
    return farthest;
}

/// Rows are the axes of the frame. size: root of the mean squared distance from the centre.
glm::dmat3 find_axes(const HexMesh& mesh, const Topology& topology, const std::vector<Label>& label,
                     const Point& centre, double size) {
    const auto squared = [&](Index v) {
        const Point d = mesh.positions[v] - centre;
        return glm::dot(d, d) / (size * size);
    };
    std::vector<Point> moments = label_moments(mesh, topology, label, centre);
    moments.push_back(mean_of(mesh, topology, centre, squared));
    moments.push_back(mean_of(mesh, topology, centre,
                              [&](Index v) { return weight_of(label[v], kLabelMoments) * squared(v); }));
    const auto is_long = [&](const Point& moment) { return glm::length(moment) > kLeastMoment * size; };

    const Point first = longest_of(moments);
    const Point x =
        glm::normalize(is_long(first) ? first : find_outlier(mesh, topology, label, centre, size, Point(0)));
    for (Point& m : moments) m = perpendicular(m, x);
    Point second = longest_of(moments);
    if (!is_long(second)) second = find_outlier(mesh, topology, label, centre, size, x);
    if (!is_long(second)) // all on a line
        second = longest_of(
            {perpendicular({1, 0, 0}, x), perpendicular({0, 1, 0}, x), perpendicular({0, 0, 1}, x)});
    const Point y = glm::normalize(perpendicular(glm::normalize(second), x));
    return glm::transpose(glm::dmat3(x, y, glm::cross(x, y)));
}

double shortest_cell(const HexMesh& mesh, const Parallel& parallel) {
    return parallel.reduce(
        mesh.cell_count(), 4096, HUGE_VAL,
        [&](std::size_t begin, std::size_t end) {
            double least = HUGE_VAL;
            for (std::size_t c = begin; c < end; ++c) {
                double sum = 0;
                for (const auto& edge : hex::kEdgeVertex)
                    sum += glm::distance(mesh.positions[mesh.cells[c][edge[0]]],
                                         mesh.positions[mesh.cells[c][edge[1]]]);
                least = std::min(least, sum / 12);
            }
            return least;
        },
        [](double a, double b) { return std::min(a, b); });
}

CanonicalPose compute_pose(const HexMesh& mesh, const Topology& topology, const std::vector<Label>& label,
                           const Parallel& parallel) {
    CanonicalPose pose;
    pose.centre = mean_of(mesh, topology, Point(0), [](Index) { return 1; });
    // Once more from there, where less is lost.
    pose.centre += mean_of(mesh, topology, pose.centre, [](Index) { return 1; });
    long double sum = 0;
    std::size_t count = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        if (topology.vertex_cell[v].empty()) continue;
        const Point d = mesh.positions[v] - pose.centre;
        sum += static_cast<long double>(glm::dot(d, d));
        ++count;
    }
    const double size =
        static_cast<double>(std::sqrt(sum / static_cast<long double>(std::max<std::size_t>(1, count))));
    if (!(size > 0)) return pose;
    pose.scale = 1 / size;
    pose.turn = find_axes(mesh, topology, label, pose.centre, size);
    const double wanted = std::clamp(kOffTies * kGridOfCell * pose.scale * shortest_cell(mesh, parallel),
                                     kFinestGrid, kCoarsestGrid);
    pose.grid = std::exp2(std::floor(std::log2(wanted)));
    std::vector<Point> boundary;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (topology.on_boundary[v]) boundary.push_back(pose.place(mesh.positions[v]));
    pose.box = find_tight_box(boundary);
    return pose;
}

std::vector<Index> number_vertices(const std::vector<Point>& placed, const std::vector<Label>& label) {
    Point low(HUGE_VAL), high(-HUGE_VAL);
    for (const Point& p : placed)
        for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    const Point extent = high - low;
    const double scale = 2097151.0 / std::max({extent.x, extent.y, extent.z, 1e-300});
    std::vector<std::uint64_t> code(placed.size());
    for (std::size_t v = 0; v < placed.size(); ++v) {
        const Point p = (placed[v] - low) * scale;
        code[v] = morton_code(static_cast<std::uint64_t>(p.x), static_cast<std::uint64_t>(p.y),
                              static_cast<std::uint64_t>(p.z));
    }
    std::vector<Index> order(placed.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
        const auto key = [&](Index v) {
            return std::tie(code[v], placed[v].x, placed[v].y, placed[v].z, label[v]);
        };
        return key(a) != key(b) ? key(a) < key(b) : a < b;
    });
    return invert_order(order, placed.size());
}

/// The three ways to number a cell's corners that start with each of them.
const std::array<std::array<Cell, 3>, 8>& ways_from_corner() {
    static const auto ways = [] {
        std::array<std::array<Cell, 3>, 8> result{};
        std::array<int, 8> count{};
        for (int x = 0; x < 8; ++x) // where the axes of the turned cell begin and point to
            for (int i = 0; i < 3; ++i) {
                const std::array<int, 3> at = {hex::kVertexX[x], hex::kVertexY[x], hex::kVertexZ[x]};
                const bool mirrored = ((at[0] + at[1] + at[2]) & 1) != 0;
                const std::array<int, 3> axis = {i, (i + (mirrored ? 2 : 1)) % 3,
                                                 (i + (mirrored ? 1 : 2)) % 3};
                Cell& way = result[x][count[x]++];
                for (int k = 0; k < 8; ++k) {
                    std::array<int, 3> p = at;
                    if (hex::kVertexX[k]) p[axis[0]] ^= 1;
                    if (hex::kVertexY[k]) p[axis[1]] ^= 1;
                    if (hex::kVertexZ[k]) p[axis[2]] ^= 1;
                    way[k] = static_cast<Index>(hex::vertex_at(p[0], p[1], p[2]));
                }
            }
        return result;
    }();
    return ways;
}

/// The least of the 24 numberings of a cell's corners that keep its orientation.
Cell turned(const Cell& cell) {
    const auto first = static_cast<std::size_t>(std::min_element(cell.begin(), cell.end()) - cell.begin());
    Cell best{};
    bool has_best = false;
    for (const Cell& way : ways_from_corner()[first]) {
        Cell next;
        for (int k = 0; k < 8; ++k) next[k] = cell[way[k]];
        if (!has_best || next < best) best = next, has_best = true;
    }
    return best;
}

} // namespace

Point CanonicalPose::place(const Point& x) const {
    const Point p = turn * (scale * (x - centre));
    if (!(grid > 0)) return p;
    return box * (grid * glm::floor(p / grid + kOffTies));
}

Point CanonicalPose::way_back(const Point& step) const {
    return (1 / scale) * (glm::transpose(turn) * (glm::transpose(box) * step));
}

CanonicalForm compute_canonical_form(const HexMesh& mesh, const Topology& topology,
                                     const Parallel& parallel) {
    CanonicalForm form;
    const std::vector<Label> label = label_vertices(mesh, topology, parallel);
    form.pose = compute_pose(mesh, topology, label, parallel);
    std::vector<Point> placed(mesh.vertex_count());
    parallel.for_each(placed.size(), 4096,
                      [&](std::size_t v) { placed[v] = form.pose.place(mesh.positions[v]); });
    form.remap.vertex_count = mesh.vertex_count();
    form.remap.cell_count = mesh.cell_count();
    form.remap.vertex_old2new = number_vertices(placed, label);
    std::vector<Cell> cells(mesh.cell_count());
    parallel.for_each(cells.size(), 4096, [&](std::size_t c) {
        for (int k = 0; k < 8; ++k) cells[c][k] = form.remap.vertex_old2new[mesh.cells[c][k]];
        cells[c] = turned(cells[c]);
    });
    std::vector<Index> order(cells.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return cells[a] < cells[b]; });
    form.remap.cell_old2new = invert_order(order, cells.size());
    form.mesh = apply_remap(mesh, form.remap);
    for (std::size_t c = 0; c < cells.size(); ++c) form.mesh.cells[form.remap.cell_old2new[c]] = cells[c];
    for (BoundaryQuad& quad : form.mesh.boundary)
        std::rotate(quad.vertices.begin(), std::min_element(quad.vertices.begin(), quad.vertices.end()),
                    quad.vertices.end());
    std::sort(form.mesh.boundary.begin(), form.mesh.boundary.end(),
              [](const BoundaryQuad& a, const BoundaryQuad& b) { return a.vertices < b.vertices; });
    form.mesh.positions = remap_values<Point>(placed, form.remap.vertex_old2new, mesh.vertex_count());
    apply_hanging(form.mesh, parallel);
    return form;
}

} // namespace hexopt
