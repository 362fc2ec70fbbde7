#include "mesh/constraint_midpoints.hpp"

#include "core/random.hpp"
#include "mesh/hanging.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace hexopt {

namespace {

std::uint64_t add_to_hash(std::uint64_t hash, Index id) { return mix_bits(hash ^ id); }

} // namespace

ConstraintMidpoints::ConstraintMidpoints(const HexMesh& mesh)
    : hanging_(mesh.hanging), row_of_(compute_hanging_row(mesh.hanging, mesh.vertex_count())) {
    if (hanging_.count() == 0) return;
    table_.assign(std::bit_ceil(std::max<std::size_t>(4, 2 * hanging_.count())), kNoIndex);
    for (Index row = 0; row < hanging_.count(); ++row) {
        std::uint64_t hash = 0;
        for (Index id : masters(row)) hash = add_to_hash(hash, id);
        std::size_t slot = hash & (table_.size() - 1);
        while (table_[slot] != kNoIndex) slot = (slot + 1) & (table_.size() - 1);
        table_[slot] = row;
    }
}

void ConstraintMidpoints::find(Index from, Index to, std::vector<Index>& found) const {
    if (table_.empty()) return;
    constexpr std::size_t kFew = 16; // more than cells halved once or twice depend on
    const std::size_t most = half_count(from) + half_count(to);
    std::array<Term, kFew> few;
    std::vector<Term> many(most > kFew ? most : 0);
    const std::span<Term> room = most > kFew ? std::span(many) : std::span(few);
    std::size_t count = add_half(from, room, 0);
    count = add_half(to, room, count);
    find_row(room.first(count), found);
}

std::size_t ConstraintMidpoints::half_count(Index v) const {
    return row_of_[v] == kNoIndex ? 1 : masters(row_of_[v]).size();
}

std::size_t ConstraintMidpoints::add_half(Index v, std::span<Term> terms, std::size_t count) const {
    const auto add = [&](Index id, double weight) {
        std::size_t at = count;
        while (at > 0 && terms[at - 1].id > id) --at;
        if (at > 0 && terms[at - 1].id == id) {
            terms[at - 1].weight += weight;
            return;
        }
        std::move_backward(terms.begin() + static_cast<std::ptrdiff_t>(at),
                           terms.begin() + static_cast<std::ptrdiff_t>(count),
                           terms.begin() + static_cast<std::ptrdiff_t>(count) + 1);
        terms[at] = {id, weight};
        ++count;
    };
    const Index row = row_of_[v];
    if (row == kNoIndex) {
        add(v, 0.5);
        return count;
    }
    for (std::size_t k = hanging_.offset[row]; k < hanging_.offset[row + 1]; ++k)
        add(hanging_.master[k], hanging_.weight[k] / 2);
    return count;
}

void ConstraintMidpoints::find_row(std::span<const Term> terms, std::vector<Index>& found) const {
    std::uint64_t hash = 0;
    for (const Term& term : terms) hash = add_to_hash(hash, term.id);
    const auto is_same = [](Index id, const Term& term) { return id == term.id; };
    const auto is_close = [](const Term& term, double weight) {
        return std::abs(term.weight - weight) < 1e-6;
    };
    for (std::size_t slot = hash & (table_.size() - 1); table_[slot] != kNoIndex;
         slot = (slot + 1) & (table_.size() - 1)) {
        const Index row = table_[slot];
        const auto ids = masters(row);
        if (!std::equal(ids.begin(), ids.end(), terms.begin(), terms.end(), is_same)) continue;
        const double* w = hanging_.weight.data() + hanging_.offset[row];
        if (std::equal(terms.begin(), terms.end(), w, is_close)) found.push_back(hanging_.vertex[row]);
    }
}

} // namespace hexopt
