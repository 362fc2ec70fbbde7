#include "mesh/colouring.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <numeric>

namespace hexopt {

namespace {

constexpr int kRounds = 6; ///< of greedy colouring at most

/// Colours in use round each cell, 64 a page. A cell sees a colour at most once, so taking a colour away
/// again is exact.
class CellColours {
  public:
    CellColours(const Stencils& stencils, std::size_t cell_count)
        : stencils_(stencils), cell_count_(cell_count) {}

    std::size_t page_count() const { return pages_.size(); }

    /// Colours of a page that neighbours of a vertex (or itself) have.
    std::uint64_t used_near(Index vertex, std::size_t page) const {
        std::uint64_t used = 0;
        for (BallEntry at : stencils_.ball(vertex)) used |= pages_[page][at.cell];
        return used;
    }
    std::uint16_t lowest_free(Index vertex) const {
        for (std::size_t page = 0; page < pages_.size(); ++page)
            if (const std::uint64_t used = used_near(vertex, page); ~used)
                return static_cast<std::uint16_t>(page * 64 + std::countr_one(used));
        return static_cast<std::uint16_t>(pages_.size() * 64);
    }
    void flip(Index vertex, std::uint16_t colour) {
        while (pages_.size() <= colour / 64u) pages_.emplace_back(cell_count_, 0);
        for (BallEntry at : stencils_.ball(vertex))
            pages_[colour / 64][at.cell] ^= std::uint64_t{1} << colour % 64;
    }

  private:
    const Stencils& stencils_;
    std::size_t cell_count_;
    std::vector<std::vector<std::uint64_t>> pages_;
};

/// Tries to empty small colours.
class ColourMerger {
  public:
    ColourMerger(const HexMesh& mesh, const Topology& topology, const Stencils& stencils, CellColours& near,
                 std::vector<std::uint16_t>& colour, std::size_t colour_count)
        : mesh_(mesh), topology_(topology), stencils_(stencils), near_(near), colour_(colour),
          members_(colour_count) {
        std::vector<std::size_t> size(colour_count, 0);
        std::size_t total = 0;
        for (std::uint16_t c : colour_)
            if (c != kNoColour) ++size[c], ++total;
        const std::size_t small = std::max<std::size_t>(64, total / 200);
        for (Index v = 0; v < colour_.size(); ++v)
            if (colour_[v] != kNoColour && size[colour_[v]] <= small) members_[colour_[v]].push_back(v);
        for (std::uint16_t c = 0; c < colour_count; ++c)
            if (size[c] <= small) small_.push_back(c);
        std::stable_sort(small_.begin(), small_.end(),
                         [&](std::uint16_t a, std::uint16_t b) { return size[a] < size[b]; });
        is_closed_.assign(colour_count, 0);
    }

    void run() {
        for (std::uint16_t c : small_) {
            is_closed_[c] = 1; // nothing may move into a colour that is being emptied
            bool is_empty = true;
            for (Index v : members_[c])
                if (colour_[v] == c) is_empty &= move(v);
            if (!is_empty) is_closed_[c] = 0;
        }
    }

  private:
    bool move(Index v) {
        for (std::uint16_t c = 0; c < is_closed_.size(); ++c)
            if (!is_closed_[c] && is_free(v, c)) return recolour(v, c), true;
        for (std::uint16_t c = 0; c < is_closed_.size(); ++c)
            if (!is_closed_[c] && c != colour_[v] && exchange(v, c)) return true;
        return false;
    }

    /// Gives v a colour after its neighbours of that colour, which are no neighbours of each other, got
    /// another.
    bool exchange(Index v, std::uint16_t wanted) {
        const std::vector<Index> blocking = neighbours(v, wanted);
        std::vector<std::uint16_t> other;
        for (Index b : blocking) {
            const auto fits = [&](std::uint16_t c) { return !is_closed_[c] && c != wanted && is_free(b, c); };
            std::uint16_t c = 0;
            while (c < is_closed_.size() && !fits(c)) ++c;
            if (c == is_closed_.size()) return false;
            other.push_back(c);
        }
        for (std::size_t i = 0; i < blocking.size(); ++i) recolour(blocking[i], other[i]);
        recolour(v, wanted);
        return true;
    }

    bool is_free(Index v, std::uint16_t c) const { return !(near_.used_near(v, c / 64) >> c % 64 & 1); }

    void recolour(Index v, std::uint16_t c) {
        near_.flip(v, colour_[v]);
        near_.flip(v, colour_[v] = c);
        if (!members_[c].empty()) members_[c].push_back(v);
    }

    std::vector<Index> neighbours(Index v, std::uint16_t wanted) const {
        std::vector<Index> found;
        const auto look_at = [&](Index w) {
            if (colour_[w] == wanted && std::find(found.begin(), found.end(), w) == found.end())
                found.push_back(w);
        };
        for (BallEntry at : stencils_.ball(v))
            for (Index w : mesh_.cells[at.cell]) {
                const Index row = topology_.hanging_row.empty() ? kNoIndex : topology_.hanging_row[w];
                if (row == kNoIndex)
                    look_at(w);
                else
                    for (std::size_t k = mesh_.hanging.offset[row]; k < mesh_.hanging.offset[row + 1]; ++k)
                        look_at(mesh_.hanging.master[k]);
            }
        return found;
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    const Stencils& stencils_;
    CellColours& near_;
    std::vector<std::uint16_t>& colour_;
    std::vector<std::vector<Index>> members_; ///< of small colours
    std::vector<std::uint16_t> small_;        ///< smallest first
    std::vector<std::uint8_t> is_closed_;
};

/// First fit; returns the number of colours.
std::size_t colour_greedily(const std::vector<Index>& order, CellColours& near,
                            std::vector<std::uint16_t>& colour) {
    std::size_t colour_count = 0;
    for (Index v : order) {
        colour[v] = near.lowest_free(v);
        near.flip(v, colour[v]);
        colour_count = std::max<std::size_t>(colour_count, colour[v] + 1u);
    }
    return colour_count;
}

/// Most vertices that one cell depends on: they all differ in colour.
std::size_t largest_clique(const Stencils& stencils, const std::vector<Index>& order,
                           std::size_t cell_count) {
    std::vector<std::uint16_t> count(cell_count, 0);
    for (Index v : order)
        for (BallEntry at : stencils.ball(v)) ++count[at.cell];
    return count.empty() ? 0 : *std::max_element(count.begin(), count.end());
}

/// Renumbers colours by falling size, drops empty ones and lists their vertices.
void list_classes(Colouring& colouring, std::size_t colour_count) {
    std::vector<std::size_t> size(colour_count, 0);
    for (std::uint16_t c : colouring.colour)
        if (c != kNoColour) ++size[c];
    std::vector<std::uint16_t> order(colour_count), old2new(colour_count);
    std::iota(order.begin(), order.end(), std::uint16_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint16_t a, std::uint16_t b) { return size[a] > size[b]; });
    Csr<Index>& rows = colouring.vertices = {};
    for (std::uint16_t i = 0; i < colour_count && size[order[i]] > 0; ++i) {
        old2new[order[i]] = i;
        rows.offset.push_back(rows.offset.back() + size[order[i]]);
    }
    rows.item.resize(rows.offset.back());
    std::vector<std::size_t> next(rows.offset.begin(), rows.offset.end() - 1);
    for (Index v = 0; v < colouring.colour.size(); ++v) {
        if (colouring.colour[v] == kNoColour) continue;
        colouring.colour[v] = old2new[colouring.colour[v]];
        rows.item[next[colouring.colour[v]]++] = v;
    }
}

/// Order for the next round: class by class, smallest or last class first. First fit in such an order never
/// takes more colours than there were classes (Culberson 1992).
void order_by_class(const Colouring& colouring, int round, std::vector<Index>& order) {
    order.clear();
    const std::size_t count = colouring.count();
    for (std::size_t i = 0; i < count; ++i) {
        const auto row = colouring.vertices[round % 2 ? (i + count / 2) % count : count - 1 - i];
        order.insert(order.end(), row.begin(), row.end());
    }
}

} // namespace

Colouring compute_colouring(const HexMesh& mesh, const Topology& topology, const Stencils& stencils,
                            std::span<const std::uint8_t> movable) {
    assert(stencils.revision == mesh.revision && topology.revision == mesh.revision);
    Colouring colouring;
    colouring.revision = mesh.revision;
    std::vector<Index> order;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (!stencils.ball(v).empty() && (movable.empty() || movable[v])) order.push_back(v);
    const std::size_t fewest = largest_clique(stencils, order, mesh.cell_count());
    for (int round = 0;; ++round) {
        CellColours near(stencils, mesh.cell_count());
        colouring.colour.assign(mesh.vertex_count(), kNoColour);
        const std::size_t colour_count = colour_greedily(order, near, colouring.colour);
        ColourMerger(mesh, topology, stencils, near, colouring.colour, colour_count).run();
        list_classes(colouring, colour_count);
        if (round == kRounds || colouring.count() <= fewest) return colouring;
        order_by_class(colouring, round, order);
    }
}

} // namespace hexopt
