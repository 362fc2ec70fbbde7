#include "mesh/root_lattice.hpp"

#include "mesh/flat_table.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>

namespace hexopt {

namespace {

struct FaceAxes {
    int first, second;
};
constexpr std::array<FaceAxes, 3> kFaceAxes = {{{1, 2}, {0, 2}, {0, 1}}};

/// Corner of the cell on a face, at 0 or 1 along the face's two axes.
int face_corner(std::uint32_t face, int s, int t) {
    std::array<int, 3> at;
    at[face / 2] = static_cast<int>(face % 2);
    at[kFaceAxes[face / 2].first] = s;
    at[kFaceAxes[face / 2].second] = t;
    return hex::vertex_at(at[0], at[1], at[2]);
}

std::uint8_t find_turn(const Cell& cell, std::uint32_t face) {
    int s0 = 0, t0 = 0;
    for (int c = 1; c < 4; ++c)
        if (cell[face_corner(face, c & 1, c >> 1)] < cell[face_corner(face, s0, t0)]) s0 = c & 1, t0 = c >> 1;
    const bool swap = cell[face_corner(face, s0, 1 - t0)] < cell[face_corner(face, 1 - s0, t0)];
    return static_cast<std::uint8_t>(s0 | t0 << 1 | (swap ? 4 : 0));
}

/// Rows of `use` values by id.
Csr<std::uint32_t> invert_uses(const std::vector<Index>& id_of_use, std::size_t id_count) {
    Csr<std::uint32_t> csr;
    csr.offset.assign(id_count + 1, 0);
    for (Index id : id_of_use) ++csr.offset[id];
    std::size_t end = 0;
    for (std::size_t& offset : csr.offset) offset = end += offset;
    csr.item.resize(end);
    for (std::size_t use = id_of_use.size(); use-- > 0;)
        csr.item[--csr.offset[id_of_use[use]]] = static_cast<std::uint32_t>(use);
    return csr;
}

} // namespace

RootLattice::RootLattice(const HexMesh& roots, const RootJoints& joints) : level_(joints.level) {
    number_edges(roots);
    number_faces(roots);
    first_face_ = *std::max_element(edge_id_.begin(), edge_id_.end()) + std::uint64_t{1};
    first_cell_ = first_face_ + face_use_.size();
    // The highest entity number stays below a power of two, so that no key is ~0.
    const int entity_bits = static_cast<int>(std::bit_width(first_cell_ + roots.cell_count()));
    depth_ = std::min((64 - entity_bits) / 3, 20);
    if (!joints.empty()) place_on_larger(roots, joints);
}

RootLattice::Place RootLattice::make_place(std::uint64_t entity, std::uint32_t half,
                                           std::span<const HalfPlace> known, Index origin, Index along_s,
                                           Index along_t) const {
    const auto at = [&](Index vertex) {
        return std::find_if(known.begin(), known.end(),
                            [&](const HalfPlace& p) { return p.vertex == vertex; })
            ->at;
    };
    const std::array<int, 2> o = at(origin), s = at(along_s), t = at(along_t);
    return {entity,
            {std::int64_t{half} * o[0], std::int64_t{half} * o[1]},
            {{{s[0] - o[0], s[1] - o[1]}, {t[0] - o[0], t[1] - o[1]}}}};
}

/// The smaller faces on a larger one, and the edges between them.
void RootLattice::place_on_face(const HexMesh& roots, const RootJoints::Face& face,
                                const FlatTable& edge_at) {
    const std::size_t use = 6 * std::size_t{face.coarse.cell} + face.coarse.face;
    const std::uint8_t turn = face_turn_[use];
    std::array<HalfPlace, 9> known{};
    for (int c = 0; c < 4; ++c) {
        std::array<int, 2> at = {turn & 1 ? 1 - (c & 1) : c & 1, turn & 2 ? 1 - (c >> 1) : c >> 1};
        if (turn & 4) std::swap(at[0], at[1]);
        known[c] = {roots.cells[face.coarse.cell][face_corner(face.coarse.face, c & 1, c >> 1)],
                    {2 * at[0], 2 * at[1]}};
    }
    const auto corner_at = [&](Index vertex) {
        return std::find_if(known.begin(), known.begin() + 4,
                            [&](const HalfPlace& p) { return p.vertex == vertex; })
            ->at;
    };
    for (int k = 0; k < 4; ++k) {
        const std::array<int, 2> a = corner_at(face.corner[k]), b = corner_at(face.corner[(k + 1) % 4]);
        known[4 + k] = {face.middle[k], {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2}};
    }
    known[8] = {face.centre, {1, 1}};
    const std::uint64_t entity = first_face_ + face_id_[use];
    const std::uint32_t half = size(face.coarse.cell) / 2;
    for (const CellFace& fine : face.fine) {
        const Cell& cell = roots.cells[fine.cell];
        face_place_[6 * std::size_t{fine.cell} + fine.face] = static_cast<Index>(places_.size());
        places_.push_back(make_place(entity, half, known, cell[face_corner(fine.face, 0, 0)],
                                     cell[face_corner(fine.face, 1, 0)], cell[face_corner(fine.face, 0, 1)]));
    }
    for (Index middle : face.middle) {
        const auto [low, high] = std::minmax(middle, face.centre);
        const Index edge = edge_at.find(std::uint64_t{low} << 32 | high);
        edge_place_[edge] = static_cast<Index>(places_.size());
        places_.push_back(make_place(entity, half, known, low, high, low));
    }
}

void RootLattice::place_on_larger(const HexMesh& roots, const RootJoints& joints) {
    FlatTable edge_at;
    std::vector<Index> cell_of_edge;
    for (std::size_t use = 0; use < edge_id_.size(); ++use) {
        const auto& local = hex::kEdgeVertex[use % 12];
        const auto [low, high] =
            std::minmax(roots.cells[use / 12][local[0]], roots.cells[use / 12][local[1]]);
        edge_at.find_or_insert(std::uint64_t{low} << 32 | high, edge_id_[use]);
        if (edge_id_[use] == cell_of_edge.size()) cell_of_edge.push_back(static_cast<Index>(use / 12));
    }
    face_place_.assign(face_id_.size(), kNoIndex);
    edge_place_.assign(cell_of_edge.size(), kNoIndex);
    for (const RootJoints::Face& face : joints.faces) place_on_face(roots, face, edge_at);
    for (const RootJoints::Edge& edge : joints.edges) {
        const Index whole = edge_at.find(std::uint64_t{edge.from} << 32 | edge.to);
        const std::array<HalfPlace, 3> known = {
            {{edge.from, {0, 0}}, {edge.middle, {1, 0}}, {edge.to, {2, 0}}}};
        for (Index end : {edge.from, edge.to}) {
            const auto [low, high] = std::minmax(end, edge.middle);
            const Index part = edge_at.find(std::uint64_t{low} << 32 | high);
            if (part == kNoIndex) continue;
            edge_place_[part] = static_cast<Index>(places_.size());
            places_.push_back(make_place(whole, size(cell_of_edge[whole]) / 2, known, low, high, low));
        }
    }
}

void RootLattice::number_edges(const HexMesh& roots) {
    FlatTable table;
    edge_id_.resize(12 * roots.cell_count());
    edge_flip_.resize(edge_id_.size());
    for (std::size_t use = 0; use < edge_id_.size(); ++use) {
        const auto& local = hex::kEdgeVertex[use % 12];
        const Cell& cell = roots.cells[use / 12];
        const auto [low, high] = std::minmax(cell[local[0]], cell[local[1]]);
        edge_flip_[use] = cell[local[0]] > cell[local[1]];
        edge_id_[use] =
            table.find_or_insert(std::uint64_t{low} << 32 | high, static_cast<Index>(table.size()));
    }
}

void RootLattice::number_faces(const HexMesh& roots) {
    face_id_.resize(6 * roots.cell_count());
    face_turn_.resize(face_id_.size());
    std::vector<std::pair<Quad, std::uint32_t>> uses(face_id_.size());
    for (std::uint32_t use = 0; use < uses.size(); ++use) {
        const Cell& cell = roots.cells[use / 6];
        Quad quad;
        for (int k = 0; k < 4; ++k) quad[k] = cell[hex::kFaceVertex[use % 6][k]];
        std::sort(quad.begin(), quad.end());
        uses[use] = {quad, use};
        face_turn_[use] = find_turn(cell, use % 6);
    }
    std::sort(uses.begin(), uses.end());
    for (std::size_t i = 0; i < uses.size(); ++i) {
        const bool second = i > 0 && uses[i].first == uses[i - 1].first;
        if (second)
            face_use_.back()[1] = uses[i].second;
        else
            face_use_.push_back({uses[i].second, kNoIndex});
        face_id_[uses[i].second] = static_cast<Index>(face_use_.size() - 1);
    }
}

void RootLattice::connect(const HexMesh& roots) {
    edge_use_ = invert_uses(edge_id_, static_cast<std::size_t>(first_face_));
    std::vector<Index> vertex_of_use(8 * roots.cell_count());
    for (std::size_t use = 0; use < vertex_of_use.size(); ++use)
        vertex_of_use[use] = roots.cells[use / 8][use % 8];
    vertex_use_ = invert_uses(vertex_of_use, roots.vertex_count());
    cells_ = roots.cells;
}

void RootLattice::append_images(Index root, const Range& range, std::vector<Image>& images) const {
    const std::uint32_t n = size();
    std::array<std::array<bool, 2>, 3> reaches;
    for (int d = 0; d < 3; ++d) reaches[d] = {range.low[d] == 0, range.high[d] == n};
    for (std::uint32_t face = 0; face < 6; ++face)
        if (reaches[face / 2][face % 2]) append_face_image(root, face, range, images);
    for (std::uint32_t edge = 0; edge < 12; ++edge) {
        const FaceAxes across = kFaceAxes[edge / 4];
        if (reaches[across.first][edge & 1] && reaches[across.second][edge >> 1 & 1])
            append_edge_images(root, edge, range, images);
    }
    for (std::uint32_t k = 0; k < 8; ++k)
        if (reaches[0][hex::kVertexX[k]] && reaches[1][hex::kVertexY[k]] && reaches[2][hex::kVertexZ[k]])
            append_vertex_images(root, k, images);
}

void RootLattice::append_face_image(Index root, std::uint32_t face, const Range& range,
                                    std::vector<Image>& images) const {
    const std::size_t use = 6 * std::size_t{root} + face;
    const auto& sides = face_use_[face_id_[use]];
    const std::uint32_t other = sides[0] == use ? sides[1] : sides[0];
    if (other == kNoIndex) return;
    const std::uint32_t n = size();
    const FaceAxes from = kFaceAxes[face / 2], to = kFaceAxes[other % 6 / 2];
    std::array<std::array<std::uint32_t, 2>, 2> span = {
        {{range.low[from.first], range.high[from.first]}, {range.low[from.second], range.high[from.second]}}};
    const auto flip = [&](std::array<std::uint32_t, 2>& s) { s = {n - s[1], n - s[0]}; };
    const std::uint8_t turn = face_turn_[use], back = face_turn_[other];
    for (int k = 0; k < 2; ++k)
        if (turn >> k & 1) flip(span[k]);
    const bool swapped = ((turn ^ back) & 4) != 0;
    if (swapped) std::swap(span[0], span[1]);
    for (int k = 0; k < 2; ++k)
        if (back >> k & 1) flip(span[k]);
    Image image{other / 6, {}, {-1, -1, -1}};
    const int normal = static_cast<int>(other % 6 / 2);
    image.range.low[normal] = image.range.high[normal] = other % 2 ? n : 0;
    image.range.low[to.first] = span[0][0], image.range.high[to.first] = span[0][1];
    image.range.low[to.second] = span[1][0], image.range.high[to.second] = span[1][1];
    image.axis[from.first] = swapped ? to.second : to.first;
    image.axis[from.second] = swapped ? to.first : to.second;
    image.axis[face / 2] = normal;
    images.push_back(image);
}

void RootLattice::append_edge_images(Index root, std::uint32_t edge, const Range& range,
                                     std::vector<Image>& images) const {
    const std::size_t use = 12 * std::size_t{root} + edge;
    const std::uint32_t n = size();
    const int along = static_cast<int>(edge / 4);
    for (std::uint32_t other : edge_use_[edge_id_[use]]) {
        if (other / 12 == root) continue;
        const std::uint32_t e = other % 12;
        const int to = static_cast<int>(e / 4);
        Image image{other / 12, {}, {-1, -1, -1}};
        std::uint32_t low = range.low[along], high = range.high[along];
        if (edge_flip_[use] != edge_flip_[other]) std::tie(low, high) = std::pair(n - high, n - low);
        image.range.low[to] = low, image.range.high[to] = high;
        const FaceAxes across = kFaceAxes[to];
        image.range.low[across.first] = image.range.high[across.first] = e & 1 ? n : 0;
        image.range.low[across.second] = image.range.high[across.second] = e >> 1 & 1 ? n : 0;
        image.axis[along] = to;
        images.push_back(image);
    }
}

void RootLattice::append_vertex_images(Index root, std::uint32_t corner, std::vector<Image>& images) const {
    const std::uint32_t n = size();
    for (std::uint32_t other : vertex_use_[cells_[root][corner]]) {
        if (other / 8 == root) continue;
        const std::uint32_t k = other % 8;
        const LatticePoint at = {hex::kVertexX[k] ? n : 0, hex::kVertexY[k] ? n : 0,
                                 hex::kVertexZ[k] ? n : 0};
        images.push_back({other / 8, {at, at}, {-1, -1, -1}});
    }
}

} // namespace hexopt
