#include "mesh/refine_cells.hpp"

#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <cassert>

namespace hexopt {

std::vector<Index> CellRefinement::leaves() const {
    std::vector<Index> leaves, stack;
    leaves.reserve(leaf_count_);
    for (Index root = 0; root < root_count_; ++root) {
        stack.push_back(root);
        while (!stack.empty()) {
            const Index n = stack.back();
            stack.pop_back();
            const RefineNode& node = nodes_[n];
            if (node.is_leaf()) {
                leaves.push_back(n);
                continue;
            }
            for (int c = node.child_count(); c-- > 0;)
                stack.push_back(node.first_child + static_cast<Index>(c));
        }
    }
    return leaves;
}

LeafMesh CellRefinement::leaf_mesh(const Parallel& parallel) const {
    LeafMesh out;
    out.leaf_node = leaves();
    HexMesh& mesh = out.mesh;
    mesh.cells.resize(out.leaf_node.size());
    mesh.level.resize(out.leaf_node.size());
    std::vector<Index> number(positions_.size(), kNoIndex);
    mesh.positions.reserve(positions_.size());
    for (std::size_t c = 0; c < out.leaf_node.size(); ++c) {
        const RefineNode& node = nodes_[out.leaf_node[c]];
        for (int k = 0; k < 8; ++k) {
            Index& v = number[node.vertices[k]];
            if (v == kNoIndex) {
                v = static_cast<Index>(mesh.positions.size());
                mesh.positions.push_back(positions_[node.vertices[k]]);
            }
            mesh.cells[c][k] = v;
        }
        mesh.level[c] = node.depth();
    }
    append_hanging(out.leaf_node, number, mesh);
    apply_hanging(mesh, parallel);
    append_boundary(out.leaf_node, mesh);
    mesh.revision = 1;
    return out;
}

namespace {

/// Places in the middle of the edges and faces, in half cells, and the corners that they depend on.
struct HangingPlace {
    std::array<int, 3> half;
    std::array<std::uint8_t, 4> corner;
    int count;
};

const std::array<HangingPlace, 18> kHangingPlace = [] {
    std::array<HangingPlace, 18> places{};
    const auto sum = [](std::span<const std::uint8_t> corners, int scale) {
        std::array<int, 3> half = {0, 0, 0};
        for (std::uint8_t k : corners)
            half[0] += hex::kVertexX[k], half[1] += hex::kVertexY[k], half[2] += hex::kVertexZ[k];
        for (int& h : half) h /= scale;
        return half;
    };
    for (int e = 0; e < 12; ++e) {
        const auto& corners = hex::kEdgeVertex[e];
        places[e] = {sum(corners, 1), {corners[0], corners[1]}, 2};
    }
    for (int f = 0; f < 6; ++f) {
        const auto& corners = hex::kFaceVertex[f];
        places[12 + f] = {sum(corners, 2), corners, 4};
    }
    return places;
}();

} // namespace

void CellRefinement::append_hanging(const std::vector<Index>& leaves, const std::vector<Index>& number,
                                    HexMesh& mesh) const {
    // Where all cuts have one mask, a leaf with a hanging vertex has a finer leaf at one of its corners.
    std::vector<std::uint8_t> finest(mesh.vertex_count(), 0);
    for (std::size_t c = 0; c < leaves.size(); ++c)
        for (Index v : mesh.cells[c]) finest[v] = std::max(finest[v], mesh.level[c]);
    struct Row {
        Index vertex;
        std::uint32_t count;
        std::array<Index, 4> master;
    };
    std::vector<Row> rows;
    std::vector<std::uint8_t> hangs(mesh.vertex_count(), 0);
    for (std::size_t c = 0; c < leaves.size(); ++c) {
        const Cell& cell = mesh.cells[c];
        if (!mixed_ &&
            std::none_of(cell.begin(), cell.end(), [&](Index v) { return finest[v] > mesh.level[c]; }))
            continue;
        for (const HangingPlace& place : kHangingPlace) {
            const Index found = find_middle(nodes_[leaves[c]], place.half);
            if (found == kNoIndex || hangs[number[found]]) continue;
            hangs[number[found]] = 1;
            Row row{number[found], static_cast<std::uint32_t>(place.count), {}};
            row.master.fill(kNoIndex);
            for (int k = 0; k < place.count; ++k) row.master[k] = cell[place.corner[k]];
            std::sort(row.master.begin(), row.master.end());
            rows.push_back(row);
        }
    }
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.vertex < b.vertex; });
    bool closed = true;
    for (const Row& row : rows) {
        const std::array<double, 4> weight = {1.0 / row.count, 1.0 / row.count, 1.0 / row.count,
                                              1.0 / row.count};
        append_row(mesh.hanging, row.vertex, std::span(row.master).first(row.count),
                   std::span(weight).first(row.count));
        for (std::uint32_t k = 0; k < row.count; ++k) closed = closed && !hangs[row.master[k]];
    }
    if (closed) return;
    Result<Hanging> all = close_hanging(mesh.hanging, mesh.vertex_count());
    assert(all.has_value()); // a vertex depends on larger cells only
    mesh.hanging = std::move(all).value();
}

void CellRefinement::append_boundary(const std::vector<Index>& leaves, HexMesh& mesh) const {
    mesh.patch_names = root_mesh_.patch_names;
    if (root_face_patch_.empty()) return;
    for (std::size_t c = 0; c < leaves.size(); ++c) {
        const RefineNode& node = nodes_[leaves[c]];
        for (std::uint32_t f = 0; f < 6; ++f) {
            const std::uint32_t d = f / 2, size = lattice_.size() >> node.level[d];
            if (f % 2 ? node.low[d] + size != lattice_.size(node.root) : node.low[d] != 0) continue;
            const Index patch = root_face_patch_[6 * std::size_t{node.root} + f];
            if (patch == kNoIndex) continue;
            Quad quad;
            for (int k = 0; k < 4; ++k) quad[k] = mesh.cells[c][hex::kFaceVertex[f][k]];
            mesh.boundary.push_back({quad, patch});
        }
    }
}

} // namespace hexopt
