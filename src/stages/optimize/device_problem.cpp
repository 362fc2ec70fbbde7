#include "stages/optimize/device_problem.hpp"

#include "mesh/hex_reference.hpp"
#include "stages/optimize/regular_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>

namespace hexopt {

using compute::Buffer;
using compute::Precision;

namespace {

constexpr std::size_t kCellChunk = 4096;

using Pattern = std::array<double, 8>;

// Rows 0..7 are the single corners; others are found as they occur.
class PatternTable {
  public:
    PatternTable() {
        for (int k = 0; k < 8; ++k) {
            Pattern single{};
            single[k] = 1;
            (void)find_or_add(single);
        }
    }
    std::uint32_t row(const Pattern& pattern) {
        if (const int corner = single_corner(pattern); corner >= 0) return static_cast<std::uint32_t>(corner);
        return find_or_add(pattern);
    }
    std::vector<double> take() { return std::move(values_); }

  private:
    static int single_corner(const Pattern& pattern) {
        int corner = -1;
        for (int k = 0; k < 8; ++k) {
            if (pattern[k] == 0) continue;
            if (corner >= 0 || pattern[k] != 1) return -1;
            corner = k;
        }
        return corner;
    }
    std::uint32_t find_or_add(const Pattern& pattern) {
        const auto [entry, is_new] = rows_.try_emplace(pattern, static_cast<std::uint32_t>(rows_.size()));
        if (is_new) values_.insert(values_.end(), pattern.begin(), pattern.end());
        return entry->second;
    }

    std::map<Pattern, std::uint32_t> rows_;
    std::vector<double> values_;
};

// How much of a dof's displacement each corner of a cell makes.
Pattern pattern_of(const Problem& problem, const Cell& cell, Index dof) {
    Pattern pattern{};
    for (int k = 0; k < 8; ++k)
        for (const DofShare& share : problem.shares(cell[k]))
            if (share.dof == dof) pattern[k] += share.weight;
    return pattern;
}

// The same of all dofs of a cell with itself as row, where one corner and no other makes it; else kNoIndex.
void find_single_corners(const Problem& problem, std::size_t cell, std::span<std::uint32_t> rows) {
    const auto dofs = problem.cell_dof()[cell];
    for (std::size_t i = 0; i < dofs.size(); ++i) {
        rows[i] = kNoIndex;
        int corners = problem.cell_has_hanging(cell) ? 2 : 0;
        for (std::uint32_t k = 0; k < 8 && corners < 2; ++k)
            if (problem.vertex_dof(problem.cell(cell)[k]) == dofs[i]) rows[i] = ++corners == 1 ? k : kNoIndex;
    }
}

void collect_balls(const Problem& problem, DofBalls& balls, const Parallel& parallel) {
    const Csr<Index>& cell_dof = problem.cell_dof();
    std::vector<std::uint32_t> rows(cell_dof.item.size());
    parallel.for_each(problem.cell_count(), kCellChunk, [&](std::size_t c) {
        find_single_corners(problem, c, std::span(rows).subspan(cell_dof.offset[c], cell_dof[c].size()));
    });
    balls.offset.assign(problem.dof_count() + 1, 0);
    for (Index dof : cell_dof.item) ++balls.offset[dof + 1];
    for (std::size_t d = 0; d < problem.dof_count(); ++d) balls.offset[d + 1] += balls.offset[d];
    balls.item.resize(2 * cell_dof.item.size());
    std::vector<std::uint32_t> next(balls.offset.begin(), balls.offset.end() - 1);
    PatternTable table;
    for (std::size_t c = 0; c < problem.cell_count(); ++c)
        for (std::size_t i = cell_dof.offset[c]; i < cell_dof.offset[c + 1]; ++i) {
            const Index dof = cell_dof.item[i];
            const std::size_t entry = next[dof]++;
            balls.item[2 * entry] = static_cast<std::uint32_t>(c);
            balls.item[2 * entry + 1] =
                rows[i] != kNoIndex ? rows[i] : table.row(pattern_of(problem, problem.cell(c), dof));
        }
    balls.pattern = table.take();
}

// Greedy in dof order; two dofs conflict where a cell depends on both.
void colour_dofs(const Problem& problem, DofBalls& balls) {
    const std::size_t dofs = problem.dof_count();
    std::vector<std::uint32_t> colour(dofs, kNoIndex);
    std::vector<std::uint32_t> used_by; // colour -> last dof that saw it taken
    for (std::uint32_t d = 0; d < dofs; ++d) {
        for (std::uint32_t i = balls.offset[d]; i < balls.offset[d + 1]; ++i)
            for (Index other : problem.cell_dof()[balls.item[2 * i]])
                if (colour[other] != kNoIndex) used_by[colour[other]] = d;
        std::uint32_t free = 0;
        while (free < used_by.size() && used_by[free] == d) ++free;
        if (free == used_by.size()) used_by.push_back(kNoIndex);
        colour[d] = free;
    }
    for (std::uint32_t c = 0; c < used_by.size(); ++c) {
        for (std::uint32_t d = 0; d < dofs; ++d)
            if (colour[d] == c) balls.colours.item.push_back(d);
        balls.colours.offset.push_back(balls.colours.item.size());
    }
}

// Vertices joined to each dof's by an edge, rising.
Csr<std::uint32_t> collect_neighbours(const Problem& problem, const DofBalls& balls) {
    Csr<std::uint32_t> neighbours;
    std::vector<std::uint32_t> list;
    for (std::uint32_t d = 0; d < problem.dof_count(); ++d) {
        const Index vertex = problem.dof_vertex()[d];
        list.clear();
        for (std::uint32_t i = balls.offset[d]; i < balls.offset[d + 1]; ++i) {
            const Cell& cell = problem.cell(balls.item[2 * i]);
            for (const auto& edge : hex::kEdgeVertex) {
                if (cell[edge[0]] == vertex) list.push_back(cell[edge[1]]);
                if (cell[edge[1]] == vertex) list.push_back(cell[edge[0]]);
            }
        }
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
        neighbours.item.insert(neighbours.item.end(), list.begin(), list.end());
        neighbours.offset.push_back(neighbours.item.size());
    }
    return neighbours;
}

double mean_edge(const HexMesh& mesh, std::span<const Point> positions) {
    double sum = 0;
    for (const Cell& cell : mesh.cells)
        for (const auto& edge : hex::kEdgeVertex)
            sum += glm::distance(positions[cell[edge[0]]], positions[cell[edge[1]]]);
    return sum / (12.0 * static_cast<double>(mesh.cell_count()));
}

// The rows of hanging vertices that move with some dof.
struct HangingRows {
    std::vector<std::uint32_t> vertex, offset = {0}, master;
    std::vector<double> weight;
};

HangingRows moving_rows(const Problem& problem) {
    const Hanging& hanging = problem.mesh().hanging;
    HangingRows rows;
    for (std::size_t row = 0; row < hanging.count(); ++row) {
        if (problem.shares(hanging.vertex[row]).empty()) continue;
        rows.vertex.push_back(hanging.vertex[row]);
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k) {
            rows.master.push_back(hanging.master[k]);
            rows.weight.push_back(hanging.weight[k]);
        }
        rows.offset.push_back(static_cast<std::uint32_t>(rows.master.size()));
    }
    return rows;
}

// Creates buffers one after another and remembers the first failure.
class Uploader {
  public:
    explicit Uploader(DeviceProblem& device) : device_(device) {}
    template <class T>
    void indices(Buffer& to, std::span<const T> values, std::string_view label) {
        static_assert(sizeof(T) % 4 == 0);
        keep(to, [&] { return compute::create_array<T>(*device_.backend, values, label); });
    }
    void reals(Buffer& to, std::span<const double> values, std::string_view label) {
        keep(to, [&] { return device_.upload_reals(values, label); });
    }
    void empty(Buffer& to, std::size_t bytes, std::string_view label) {
        keep(to, [&] { return device_.backend->create_buffer(std::max<std::size_t>(bytes, 4), label); });
    }
    void check(Status status) {
        if (status_ && !status) status_ = status;
    }
    const Status& status() const { return status_; }

  private:
    template <class Make>
    void keep(Buffer& to, const Make& make) {
        if (!status_) return;
        auto made = make();
        if (made)
            to = std::move(*made);
        else
            status_ = made.error();
    }
    DeviceProblem& device_;
    Status status_ = Done{};
};

} // namespace

DeviceFrame DeviceFrame::of(const HexMesh& mesh, std::span<const Point> positions, Precision precision) {
    DeviceFrame frame;
    if (mesh.cell_count() > 0)
        frame.unit = std::exp2(std::round(std::log2(std::max(1e-300, mean_edge(mesh, positions)))));
    if (precision == Precision::f32 && !positions.empty()) {
        Point low = positions[0], high = low;
        for (const Point& p : positions) low = glm::min(low, p), high = glm::max(high, p);
        frame.origin = 0.5 * (low + high);
    }
    return frame;
}

namespace {

std::vector<float> to_floats(std::span<const Point> points) {
    std::vector<float> single;
    single.reserve(3 * points.size());
    for (const Point& p : points)
        for (int axis = 0; axis < 3; ++axis) single.push_back(static_cast<float>(p[axis]));
    return single;
}

} // namespace

Result<Buffer> upload_points(compute::Backend& backend, Precision precision, std::span<const Point> local,
                             std::string_view label) {
    if (precision != Precision::f32) return compute::create_array<Point>(backend, local, label);
    return compute::create_array<float>(backend, to_floats(local), label);
}

DofBalls compute_dof_balls(const Problem& problem, const Parallel& parallel) {
    DofBalls balls;
    collect_balls(problem, balls, parallel);
    colour_dofs(problem, balls);
    return balls;
}

Result<Buffer> DeviceProblem::create_reals(std::size_t count, std::string_view label) {
    return backend->create_buffer(std::max<std::size_t>(count, 1) * real_bytes(), label);
}

Result<Buffer> DeviceProblem::upload_reals(std::span<const double> values, std::string_view label) {
    if (precision == Precision::f64) return compute::create_array<double>(*backend, values, label);
    const std::vector<float> narrow(values.begin(), values.end());
    return compute::create_array<float>(*backend, narrow, label);
}

Result<std::vector<double>> DeviceProblem::read_reals(const Buffer& buffer, std::size_t count) {
    if (precision == Precision::f64) return compute::read_array<double>(*backend, buffer, count);
    auto narrow = compute::read_array<float>(*backend, buffer, count);
    if (!narrow) return narrow.error();
    return std::vector<double>(narrow->begin(), narrow->end());
}

Status DeviceProblem::upload_positions(std::span<const Point> positions) {
    std::vector<Point> local(positions.begin(), positions.end());
    for (Point& p : local) p = frame.to_local(p);
    return write_points(points, local);
}

Status DeviceProblem::write_points(const Buffer& target, std::span<const Point> local) {
    if (precision != Precision::f32) return backend->upload(target, 0, std::as_bytes(local));
    const std::vector<float> single = to_floats(local);
    return backend->upload(target, 0, std::as_bytes(std::span<const float>(single)));
}

Status DeviceProblem::download_positions(std::span<Point> positions) {
    std::vector<double> local;
    if (precision == Precision::f32) {
        auto read = compute::read_array<float>(*backend, points, 3 * positions.size());
        if (!read) return read.error();
        local.assign(read->begin(), read->end());
    } else {
        auto read = compute::read_array<double>(*backend, points, 3 * positions.size());
        if (!read) return read.error();
        local = std::move(*read);
    }
    const auto take = [&](Index v) {
        positions[v] = frame.to_model(Point(local[3 * v], local[3 * v + 1], local[3 * v + 2]));
    };
    for (Index v : problem->dof_vertex()) take(v);
    problem->apply_hanging(positions);
    return Done{};
}

void DeviceProblem::put_sliders_last(std::span<const std::uint8_t> slides) {
    for (std::size_t c = 0; c < colours.rows(); ++c) {
        const auto begin = colours.item.begin() + static_cast<std::ptrdiff_t>(colours.offset[c]);
        const auto end = colours.item.begin() + static_cast<std::ptrdiff_t>(colours.offset[c + 1]);
        const auto free_end =
            slides.empty() ? end
                           : std::stable_partition(begin, end, [&](std::uint32_t d) { return !slides[d]; });
        free_count.push_back(static_cast<std::uint32_t>(free_end - begin));
    }
}

Status DeviceProblem::find_regular_blocks() {
    if (!regular_first.empty()) return Done{};
    const DofBalls balls = compute_dof_balls(*problem);
    std::vector<std::uint32_t> rows;
    for (std::size_t c = 0; c < colours.rows(); ++c) {
        const auto begin = colours.item.begin() + static_cast<std::ptrdiff_t>(colours.offset[c]);
        const auto regular_end = std::stable_partition(begin, begin + free_count[c], [&](std::uint32_t d) {
            const auto block = find_regular_block(*problem, balls, d);
            if (!block) return false;
            rows.insert(rows.end(), block->vertex.begin(), block->vertex.end());
            rows.insert(rows.end(), block->cell.begin(), block->cell.end());
            return true;
        });
        const auto before = static_cast<std::uint32_t>(
            regular_first.empty() ? 0 : regular_first.back() + regular_count.back());
        regular_first.push_back(before);
        regular_count.push_back(static_cast<std::uint32_t>(regular_end - begin));
    }
    Uploader up(*this);
    up.indices<std::uint32_t>(stencil, rows, "regular blocks");
    up.indices<std::uint32_t>(dof_list, colours.item, "colours");
    return up.status();
}

Status DeviceProblem::find_neighbours() {
    if (!neighbour_offset.is_empty()) return Done{};
    const Csr<std::uint32_t> found = collect_neighbours(*problem, compute_dof_balls(*problem));
    const std::vector<std::uint32_t> offset(found.offset.begin(), found.offset.end());
    Uploader up(*this);
    up.indices<std::uint32_t>(neighbour_offset, offset, "neighbour offsets");
    up.indices<std::uint32_t>(neighbour, found.item, "neighbours");
    up.reals(neighbour_weight, std::vector<double>(found.item.size(), 1.0), "neighbour weights");
    return up.status();
}

Result<DeviceProblem> DeviceProblem::create(compute::Backend& on, Precision with, const Problem& of,
                                            const DeviceFrame& in, std::span<const std::uint8_t> slides,
                                            const Parallel& parallel) {
    DeviceProblem device;
    device.backend = &on;
    device.precision = with;
    device.problem = &of;
    device.frame = in;
    device.vertex_count = static_cast<std::uint32_t>(of.mesh().vertex_count());
    device.cell_count = static_cast<std::uint32_t>(of.cell_count());
    device.dof_count = static_cast<std::uint32_t>(of.dof_count());
    DofBalls balls = compute_dof_balls(of, parallel);
    device.colours = std::move(balls.colours);
    device.put_sliders_last(slides);
    const HangingRows rows = moving_rows(of);
    device.hanging_count = static_cast<std::uint32_t>(rows.vertex.size());
    const std::vector<double> weight(of.weight().begin(), of.weight().end());
    // V / length^2 of a cell of size 2^-level is proportional to 2^-level, the root of its weight.
    std::vector<double> root = weight;
    for (double& w : root) w = std::sqrt(w);
    std::vector<Cell> cells(of.cell_count());
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = of.cell(i);

    Uploader up(device);
    up.empty(device.points, device.vertex_count * device.point_bytes(), "positions");
    up.indices<Cell>(device.cells, cells, "cells");
    up.reals(device.cell_weight, weight, "cell weights");
    up.reals(device.edge_weight, root, "edge weights");
    up.indices<std::uint32_t>(device.tet_mask, of.tet_mask(), "tetrahedra that count");
    up.empty(device.length, of.cell_count() * device.real_bytes(), "lengths");
    up.empty(device.inverse_length, of.cell_count() * device.real_bytes(), "inverse lengths");
    up.indices<std::uint32_t>(device.ball_offset, balls.offset, "ball offsets");
    up.indices<std::uint32_t>(device.ball_item, balls.item, "balls");
    up.reals(device.pattern, balls.pattern, "patterns");
    up.indices<Index>(device.dof_vertex, of.dof_vertex(), "vertices of dofs");
    up.indices<std::uint32_t>(device.dof_list, device.colours.item, "colours");
    up.indices<std::uint32_t>(device.hanging_vertex, rows.vertex, "hanging vertices");
    up.indices<std::uint32_t>(device.hanging_offset, rows.offset, "hanging offsets");
    up.indices<std::uint32_t>(device.hanging_master, rows.master, "masters");
    up.reals(device.hanging_weight, rows.weight, "hanging weights");
    if (!up.status()) return up.status().error();
    return device;
}

} // namespace hexopt
