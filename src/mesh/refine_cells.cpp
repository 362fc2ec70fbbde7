#include "mesh/refine_cells.hpp"

#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"
#include "mesh/topology.hpp"
#include "mesh/validate_structure.hpp"

#include <algorithm>
#include <bit>
#include <cassert>

namespace hexopt {

namespace {

/// Number of a place with coordinates 0, 1 or 2 in units of half a cell.
constexpr int mid_index(int x, int y, int z) { return x + 3 * y + 9 * z; }

/// What the place (0, 1, 2 along each axis) depends on: corners of the cell.
struct MidMasters {
    std::array<std::uint8_t, 8> corner;
    int count;
};

constexpr std::array<MidMasters, 27> kMidMasters = [] {
    std::array<MidMasters, 27> masters{};
    for (int p = 0; p < 27; ++p) {
        const std::array<int, 3> at = {p % 3, p / 3 % 3, p / 9};
        for (int k = 0; k < 8; ++k) {
            const std::array<int, 3> x = {2 * hex::kVertexX[k], 2 * hex::kVertexY[k], 2 * hex::kVertexZ[k]};
            bool counts = true;
            for (int d = 0; d < 3; ++d) counts = counts && (at[d] == 1 || at[d] == x[d]);
            if (counts) masters[p].corner[masters[p].count++] = static_cast<std::uint8_t>(k);
        }
    }
    return masters;
}();

std::size_t leaves_gained(AxisMask mask) { return (std::size_t{1} << std::popcount(mask)) - 1; }

} // namespace

CellRefinement::CellRefinement(HexMesh roots, const RootJoints& joints)
    : lattice_(roots, joints), root_count_(roots.cell_count()) {
    leaf_count_ = root_count_;
    positions_ = std::move(roots.positions);
    nodes_.resize(root_count_);
    for (Index c = 0; c < root_count_; ++c) {
        nodes_[c].vertices = roots.cells[c];
        nodes_[c].low = {0, 0, 0};
        nodes_[c].root = c;
        if (!joints.empty()) nodes_[c].level.fill(joints.level[c]);
    }
    if (!joints.empty()) take_hanging(joints);
    keep_patches(roots);
    root_mesh_.hanging = std::move(roots.hanging);
    root_mesh_.cells = std::move(roots.cells);
    root_mesh_.patch_names = std::move(roots.patch_names);
    root_mesh_.positions.resize(positions_.size());
}

/// The vertices in the middle of faces and edges are those that splitting the larger cell will look for.
void CellRefinement::take_hanging(const RootJoints& joints) {
    uniform_mask_ = kAllAxes;
    max_root_level_ = *std::max_element(joints.level.begin(), joints.level.end());
    FlatTable middle_of;
    for (const RootJoints::Edge& edge : joints.edges)
        middle_of.find_or_insert(std::uint64_t{edge.from} << 32 | edge.to, edge.middle);
    for (Index root = 0; root < root_count_; ++root)
        for (const auto& [a, b] : hex::kEdgeVertex) {
            const auto [low, high] = std::minmax(nodes_[root].vertices[a], nodes_[root].vertices[b]);
            const Index middle = middle_of.find(std::uint64_t{low} << 32 | high);
            if (middle == kNoIndex) continue;
            const std::array<int, 3> half = {hex::kVertexX[a] + hex::kVertexX[b],
                                             hex::kVertexY[a] + hex::kVertexY[b],
                                             hex::kVertexZ[a] + hex::kVertexZ[b]};
            vertex_at_.find_or_insert(lattice_.key(root, middle_point(nodes_[root], half)), middle);
        }
    for (const RootJoints::Face& face : joints.faces) {
        std::array<int, 3> half = {1, 1, 1};
        half[face.coarse.face / 2] = face.coarse.face % 2 ? 2 : 0;
        vertex_at_.find_or_insert(
            lattice_.key(face.coarse.cell, middle_point(nodes_[face.coarse.cell], half)), face.centre);
    }
}

void CellRefinement::keep_patches(const HexMesh& roots) {
    if (roots.boundary.empty()) return;
    const auto key = [](Quad quad) {
        std::sort(quad.begin(), quad.end());
        return quad;
    };
    std::vector<std::pair<Quad, Index>> patch_of_quad;
    for (const BoundaryQuad& quad : roots.boundary)
        patch_of_quad.emplace_back(key(quad.vertices), quad.patch);
    std::sort(patch_of_quad.begin(), patch_of_quad.end());
    root_face_patch_.resize(6 * roots.cell_count());
    for (std::size_t use = 0; use < root_face_patch_.size(); ++use) {
        const CellFace face{static_cast<Index>(use / 6), static_cast<std::uint32_t>(use % 6)};
        const Quad quad = key(face_vertices(roots, face));
        const auto found =
            std::lower_bound(patch_of_quad.begin(), patch_of_quad.end(), std::pair(quad, Index{0}));
        root_face_patch_[use] =
            found != patch_of_quad.end() && found->first == quad ? found->second : kNoIndex;
    }
}

Result<CellRefinement> CellRefinement::create(HexMesh roots, const Parallel& parallel) {
    if (roots.cell_count() == 0)
        return make_error(ErrorCode::bad_input, "refine", "", "the initial mesh has no cells");
    if (Status ok = require_structure(roots, "refine", parallel); !ok) return ok.error();
    const Result<RootJoints> joints = find_root_joints(roots, parallel);
    if (!joints) return joints.error();
    apply_hanging(roots, parallel);
    CellRefinement refinement(std::move(roots), *joints);
    if (refinement.max_root_level() >= refinement.max_level())
        return make_error(ErrorCode::bad_input, "refine", "",
                          "the initial mesh has cells of too many different sizes");
    return refinement;
}

Result<CellRefinement> CellRefinement::replay(HexMesh roots, std::span<const RefineRequest> splits,
                                              const Parallel& parallel) {
    Result<CellRefinement> made = create(std::move(roots), parallel);
    if (!made) return made;
    RefineCount count;
    for (const RefineRequest& request : splits) {
        if (!made->keep_request(request, count))
            return make_error(ErrorCode::bad_input, "refine", "cell " + std::to_string(request.node),
                              "cannot be split as the history of the refinement says");
        made->split(request.node, request.mask);
    }
    if (made->uniform_mask_ != 0) return made; // of a mesh that hangs together
    if (!splits.empty()) made->uniform_mask_ = splits.front().mask;
    made->mixed_ = std::any_of(splits.begin(), splits.end(), [&](const RefineRequest& request) {
        return request.mask != splits.front().mask;
    });
    return made;
}

HexMesh CellRefinement::roots() const {
    HexMesh mesh = root_mesh_;
    std::copy_n(positions_.begin(), mesh.positions.size(), mesh.positions.begin());
    for (Index use = 0; use < root_face_patch_.size(); ++use)
        if (root_face_patch_[use] != kNoIndex)
            mesh.boundary.push_back({face_vertices(mesh, {use / 6, use % 6}), root_face_patch_[use]});
    return mesh;
}

std::vector<RefineRequest> CellRefinement::splits() const {
    std::vector<RefineRequest> splits;
    for (Index n = 0; n < nodes_.size(); ++n)
        if (!nodes_[n].is_leaf()) splits.push_back({n, nodes_[n].mask});
    std::sort(splits.begin(), splits.end(), [&](const RefineRequest& a, const RefineRequest& b) {
        return nodes_[a.node].first_child < nodes_[b.node].first_child;
    });
    return splits;
}

LatticePoint CellRefinement::middle_point(const RefineNode& node, const std::array<int, 3>& half) const {
    LatticePoint at;
    for (int d = 0; d < 3; ++d) {
        const std::uint32_t size = lattice_.size() >> node.level[d];
        at[d] = node.low[d] + (half[d] == 2 ? size : half[d] == 1 ? size / 2 : 0);
    }
    return at;
}

Index CellRefinement::find_middle(const RefineNode& node, const std::array<int, 3>& half) const {
    for (int d = 0; d < 3; ++d)
        if (half[d] == 1 && node.level[d] == lattice_.depth()) return kNoIndex;
    return vertex_at_.find(lattice_.key(node.root, middle_point(node, half)));
}

CellRefinement::Mid27 CellRefinement::make_vertices(Index n, AxisMask mask) {
    const RefineNode node = nodes_[n];
    Mid27 vertices;
    vertices.fill(kNoIndex);
    for (int k = 0; k < 8; ++k)
        vertices[mid_index(2 * hex::kVertexX[k], 2 * hex::kVertexY[k], 2 * hex::kVertexZ[k])] =
            node.vertices[k];
    for (int p = 0; p < 27; ++p) {
        const std::array<int, 3> half = {p % 3, p / 3 % 3, p / 9};
        const int middles = (half[0] == 1 ? 1 : 0) | (half[1] == 1 ? 2 : 0) | (half[2] == 1 ? 4 : 0);
        if (middles == 0 || (middles & ~mask) != 0) continue;
        const Index fresh = static_cast<Index>(positions_.size());
        // No other cell reaches the middle of one that is cut along all axes at once.
        vertices[p] =
            middles == kAllAxes
                ? fresh
                : vertex_at_.find_or_insert(lattice_.key(node.root, middle_point(node, half)), fresh);
        if (vertices[p] != fresh) continue;
        Point sum(0);
        const MidMasters& masters = kMidMasters[p];
        for (int k = 0; k < masters.count; ++k) sum += positions_[node.vertices[masters.corner[k]]];
        positions_.push_back(sum / static_cast<double>(masters.count));
    }
    return vertices;
}

void CellRefinement::split(Index n, AxisMask mask) {
    const Mid27 vertices = make_vertices(n, mask);
    nodes_[n].mask = mask;
    nodes_[n].first_child = static_cast<Index>(nodes_.size());
    const RefineNode parent = nodes_[n];
    leaf_count_ += static_cast<std::size_t>(parent.child_count()) - 1;
    for (int c = 0; c < 8; ++c) {
        if ((c & ~mask) != 0) continue;
        RefineNode child;
        child.root = parent.root;
        std::array<std::array<int, 2>, 3> ends; // in half cells
        for (int d = 0; d < 3; ++d) {
            const bool cut = mask >> d & 1, upper = c >> d & 1;
            ends[d] = {upper ? 1 : 0, cut && !upper ? 1 : 2};
            child.level[d] = static_cast<std::uint8_t>(parent.level[d] + (cut ? 1 : 0));
            child.low[d] = parent.low[d] + (upper ? lattice_.size() >> child.level[d] : 0);
        }
        for (int k = 0; k < 8; ++k)
            child.vertices[k] = vertices[mid_index(ends[0][hex::kVertexX[k]], ends[1][hex::kVertexY[k]],
                                                   ends[2][hex::kVertexZ[k]])];
        nodes_.push_back(child);
    }
}

void CellRefinement::split_all(const std::vector<Index>& nodes) {
    // Exactly as much as is needed: nodes are most of the memory, and most come with the last levels.
    const std::size_t needed = nodes_.size() + nodes.size() * (leaves_gained(uniform_mask_) + 1);
    if (needed > nodes_.capacity()) nodes_.reserve(std::max(needed, nodes_.size() + nodes_.size() / 16));
    for (Index node : nodes) split(node, uniform_mask_);
}

bool CellRefinement::keep_request(const RefineRequest& request, RefineCount& count) const {
    bool keep = request.node < nodes_.size() && nodes_[request.node].is_leaf() && request.mask != 0 &&
                request.mask <= kAllAxes;
    if (!root_mesh_.hanging.empty()) keep = keep && request.mask == kAllAxes;
    for (int d = 0; keep && d < 3; ++d)
        if (request.mask >> d & 1) keep = nodes_[request.node].level[d] < lattice_.depth();
    if (!keep) ++count.refused;
    return keep;
}

RefineCount CellRefinement::refine(std::span<const RefineRequest> requests, int rings,
                                   std::size_t max_leaves) {
    RefineCount count;
    std::vector<RefineRequest> kept;
    for (const RefineRequest& request : requests)
        if (keep_request(request, count)) kept.push_back(request);
    if (kept.empty()) return count;
    const AxisMask mask = uniform_mask_ == 0 ? kept[0].mask : uniform_mask_;
    bool mixed = mixed_;
    for (const RefineRequest& request : kept) mixed = mixed || request.mask != mask;
    std::vector<Index> marked;
    if (!mixed) marked = mark_uniform(kept, rings, {}, 0, count);
    const std::size_t splits = mixed ? kept.size() : marked.size();
    if (leaf_count_ + splits * (mixed ? 1 : leaves_gained(mask)) > max_leaves)
        return {0, 0, count.refused, true};
    uniform_mask_ = mask;
    mixed_ = mixed;
    if (mixed_) refine_mixed(kept, count);
    split_all(marked);
    return count;
}

CellRefinement::Mark CellRefinement::mark() const {
    return {nodes_.size(), positions_.size(), leaf_count_, uniform_mask_, mixed_};
}

void CellRefinement::go_back(const Mark& mark) {
    nodes_.resize(mark.nodes);
    for (RefineNode& node : nodes_)
        if (!node.is_leaf() && node.first_child >= mark.nodes) node.mask = 0, node.first_child = kNoIndex;
    positions_.resize(mark.vertices);
    vertex_at_.drop_from(static_cast<Index>(mark.vertices));
    leaf_count_ = mark.leaves;
    uniform_mask_ = mark.uniform_mask;
    mixed_ = mark.mixed;
}

RefineCount CellRefinement::balance(std::size_t max_leaves) {
    RefineCount sum;
    for (;;) {
        std::vector<std::uint8_t> finest(positions_.size(), 0);
        const std::vector<Index> all = leaves();
        for (Index leaf : all)
            for (Index v : nodes_[leaf].vertices) finest[v] = std::max(finest[v], nodes_[leaf].depth());
        std::vector<RefineRequest> requests;
        for (Index leaf : all)
            if (const RefineNode& node = nodes_[leaf];
                std::any_of(node.vertices.begin(), node.vertices.end(),
                            [&](Index v) { return finest[v] > node.depth() + 1; }))
                requests.push_back({leaf, kAllAxes});
        if (requests.empty()) return sum;
        const RefineCount count = refine(requests, 1, max_leaves);
        sum.balance += count.requested + count.balance;
        sum.refused += count.refused;
        sum.over_budget = count.over_budget;
        if (count.requested == 0) return sum;
    }
}

RefineCount CellRefinement::surround(std::span<const Index> leaves, int layers, int rings,
                                     std::size_t max_leaves) {
    assert(!mixed_);
    RefineCount count;
    if (uniform_mask_ == 0) return count; // all leaves are of one level
    const std::vector<Index> marked = mark_uniform({}, rings, leaves, layers, count);
    if (leaf_count_ + marked.size() * leaves_gained(uniform_mask_) > max_leaves) return {0, 0, 0, true};
    split_all(marked);
    return count;
}

} // namespace hexopt
