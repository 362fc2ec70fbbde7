#include "samples/box_mesh.hpp"

#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <unordered_map>

namespace hexopt {

namespace {

using Place = std::array<std::uint32_t, 3>;

std::uint64_t key_of(const Place& p) { return std::uint64_t{p[2]} << 42 | std::uint64_t{p[1]} << 21 | p[0]; }

class VertexNumbering {
  public:
    explicit VertexNumbering(std::size_t expected) { index_.reserve(expected); }

    Index number(const Place& place) {
        const auto [it, is_new] = index_.try_emplace(key_of(place), static_cast<Index>(places_.size()));
        if (is_new) places_.push_back(place);
        return it->second;
    }
    Index find(const Place& place) const {
        const auto it = index_.find(key_of(place));
        return it == index_.end() ? kNoIndex : it->second;
    }
    const std::vector<Place>& places() const { return places_; }

  private:
    std::unordered_map<std::uint64_t, Index> index_;
    std::vector<Place> places_;
};

/// Rows of the vertices that lie inside edges and faces of boxes.
class HangingSearch {
  public:
    HangingSearch(const std::vector<LatticeBox>& boxes, const std::vector<Cell>& cells,
                  const VertexNumbering& numbering)
        : boxes_(boxes), cells_(cells), numbering_(numbering), has_row_(numbering.places().size(), 0) {}

    /// Edges first: what lies inside an edge hangs on its two ends only.
    Hanging find() {
        for (std::size_t c = 0; c < boxes_.size(); ++c)
            for (const auto& edge : hex::kEdgeVertex) search_edge(c, edge[0], edge[1]);
        for (std::size_t c = 0; c < boxes_.size(); ++c)
            for (int axis = 0; axis < 3; ++axis)
                for (int side = 0; side < 2; ++side) search_face(c, axis, side);
        return std::move(rows_);
    }

  private:
    /// With 2:1 balance and cells cut in two, neighbours are a quarter of a cell at least.
    static std::uint32_t step_of(std::uint32_t size) { return std::max(1u, size / 4); }

    void search_edge(std::size_t c, int from, int to) {
        const Place low = numbering_.places()[cells_[c][from]];
        const int axis = hex::kVertexX[from] != hex::kVertexX[to]   ? 0
                         : hex::kVertexY[from] != hex::kVertexY[to] ? 1
                                                                    : 2;
        const std::uint32_t size = boxes_[c].size[axis];
        for (std::uint32_t at = step_of(size); at < size; at += step_of(size)) {
            Place place = low;
            place[axis] += at;
            const double t = static_cast<double>(at) / size;
            append(place, {cells_[c][from], cells_[c][to]}, {1 - t, t});
        }
    }

    void search_face(std::size_t c, int axis, int side) {
        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
        const auto corner = [&](int x, int y) {
            std::array<int, 3> at;
            at[axis] = side, at[a] = x, at[b] = y;
            return cells_[c][hex::vertex_at(at[0], at[1], at[2])];
        };
        const std::uint32_t size_a = boxes_[c].size[a], size_b = boxes_[c].size[b];
        for (std::uint32_t i = step_of(size_a); i < size_a; i += step_of(size_a))
            for (std::uint32_t j = step_of(size_b); j < size_b; j += step_of(size_b)) {
                Place place = boxes_[c].low;
                place[axis] += side ? boxes_[c].size[axis] : 0;
                place[a] += i, place[b] += j;
                const double s = static_cast<double>(i) / size_a, t = static_cast<double>(j) / size_b;
                append(place, {corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)},
                       {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t});
            }
    }

    void append(const Place& place, std::initializer_list<Index> masters,
                std::initializer_list<double> weights) {
        const Index vertex = numbering_.find(place);
        if (vertex == kNoIndex || has_row_[vertex]) return;
        has_row_[vertex] = 1;
        append_row(rows_, vertex, {masters.begin(), masters.size()}, {weights.begin(), weights.size()});
    }

    const std::vector<LatticeBox>& boxes_;
    const std::vector<Cell>& cells_;
    const VertexNumbering& numbering_;
    std::vector<std::uint8_t> has_row_;
    Hanging rows_;
};

} // namespace

Result<HexMesh> make_box_mesh(const std::vector<LatticeBox>& boxes, std::uint32_t units) {
    HexMesh mesh;
    VertexNumbering numbering(boxes.size() * 5 / 4);
    mesh.cells.reserve(boxes.size());
    mesh.level.reserve(boxes.size());
    for (const LatticeBox& box : boxes) {
        Cell cell;
        for (int k = 0; k < 8; ++k)
            cell[k] = numbering.number({box.low[0] + hex::kVertexX[k] * box.size[0],
                                        box.low[1] + hex::kVertexY[k] * box.size[1],
                                        box.low[2] + hex::kVertexZ[k] * box.size[2]});
        mesh.cells.push_back(cell);
        mesh.level.push_back(box.level);
    }
    mesh.positions.reserve(numbering.places().size());
    for (const Place& p : numbering.places())
        mesh.positions.push_back(Point(p[0], p[1], p[2]) / static_cast<double>(units));
    auto closed = close_hanging(HangingSearch(boxes, mesh.cells, numbering).find(), mesh.vertex_count());
    if (!closed) return closed.error();
    mesh.hanging = std::move(closed).value();
    return mesh;
}

} // namespace hexopt
