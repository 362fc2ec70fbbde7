#include "io/vtu_pieces.hpp"

#include "io/point_hash.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <unordered_map>

namespace hexopt::io_detail {

namespace {

struct FirstUse {
    std::size_t piece;
    Index vertex;
};

const FieldData* find_like(const std::vector<FieldData>& fields, const FieldData& sought) {
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const FieldData& f) {
        return f.name == sought.name && f.components == sought.components && f.type == sought.type;
    });
    return found == fields.end() ? nullptr : &*found;
}

/// rows[p][i]: whether tuple i of piece p is kept; empty keeps all.
std::vector<FieldData> join_fields(const std::vector<VtuPiece>& pieces,
                                   std::vector<FieldData> VtuPiece::*member,
                                   const std::vector<std::vector<bool>>& rows, const std::string& file,
                                   const Context& context) {
    std::vector<FieldData> joined;
    for (const FieldData& field : pieces[0].*member) {
        FieldData whole{field.name, field.location, field.components, {}, field.type};
        bool is_everywhere = true;
        for (std::size_t p = 0; p < pieces.size(); ++p) {
            const FieldData* part = find_like(pieces[p].*member, field);
            is_everywhere = is_everywhere && part != nullptr;
            if (!is_everywhere) break;
            for (std::size_t i = 0; i < part->values.size(); ++i)
                if (rows[p].empty() || rows[p][i / field.components]) whole.values.push_back(part->values[i]);
        }
        if (is_everywhere)
            joined.push_back(std::move(whole));
        else
            context.log(LogLevel::warning, fmt::format("{}: array {} is left out: not every piece has it",
                                                       file, shown(field.name)));
    }
    return joined;
}

} // namespace

VtuPiece join_pieces(std::vector<VtuPiece>&& pieces, const std::string& file, const Context& context) {
    if (pieces.size() == 1) return std::move(pieces[0]);
    VtuPiece whole;
    whole.cells.offsets.assign(1, 0);
    std::unordered_map<Point, FirstUse, PointHash> first_use;
    std::vector<std::vector<bool>> is_new(pieces.size());
    std::size_t merged = 0;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
        const VtuPiece& piece = pieces[p];
        std::vector<Index> number(piece.positions.size());
        is_new[p].resize(piece.positions.size());
        for (std::size_t v = 0; v < number.size(); ++v) {
            const auto next = static_cast<Index>(whole.positions.size());
            const auto [entry, is_first] = first_use.try_emplace(piece.positions[v], FirstUse{p, next});
            is_new[p][v] = is_first || entry->second.piece == p;
            number[v] = is_new[p][v] ? next : entry->second.vertex;
            if (is_new[p][v])
                whole.positions.push_back(piece.positions[v]);
            else
                ++merged;
        }
        const std::uint64_t base = whole.cells.connectivity.size();
        for (Index v : piece.cells.connectivity) whole.cells.connectivity.push_back(number[v]);
        for (std::size_t c = 1; c < piece.cells.offsets.size(); ++c)
            whole.cells.offsets.push_back(base + piece.cells.offsets[c]);
        whole.cells.types.insert(whole.cells.types.end(), piece.cells.types.begin(), piece.cells.types.end());
    }
    const std::vector<std::vector<bool>> all(pieces.size());
    whole.point = join_fields(pieces, &VtuPiece::point, is_new, file, context);
    whole.cell = join_fields(pieces, &VtuPiece::cell, all, file, context);
    context.log(LogLevel::info, fmt::format("{}: {} pieces joined, {} vertices between them made one", file,
                                            pieces.size(), merged));
    return whole;
}

} // namespace hexopt::io_detail
