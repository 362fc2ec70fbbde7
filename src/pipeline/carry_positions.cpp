#include "pipeline/carry_positions.hpp"

#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>
#include <limits>

namespace hexopt {

namespace {

/// Rings of cells round what failed, or was not there, that start anew.
constexpr int kRings = 1;
/// How far apart, in edge lengths, places count as the same: layers are relaxed in an order that hangs on the
/// whole mesh.
constexpr double kNear = 0.2;
constexpr std::size_t kCellChunk = 1024;

std::uint64_t hash_of(const Point& p) {
    std::uint64_t hash = 0;
    for (int k = 0; k < 3; ++k) {
        hash ^= std::bit_cast<std::uint64_t>(p[k] + 0.0); // -0 is 0
        hash *= 0x9E3779B97F4A7C15u;
        hash ^= hash >> 29;
    }
    return hash;
}

/// Vertices by the bits of their positions.
class PositionTable {
  public:
    explicit PositionTable(std::span<const Point> positions)
        : positions_(positions), slot_(std::bit_ceil(2 * positions.size() + 1), kNoIndex) {
        for (Index v = 0; v < positions.size(); ++v) {
            std::size_t s = first_slot(positions[v]);
            while (slot_[s] != kNoIndex) s = (s + 1) & (slot_.size() - 1);
            slot_[s] = v;
        }
    }

    /// kNoIndex where there is none, or more than one.
    Index find(const Point& p) const {
        Index found = kNoIndex;
        for (std::size_t s = first_slot(p); slot_[s] != kNoIndex; s = (s + 1) & (slot_.size() - 1)) {
            if (positions_[slot_[s]] != p) continue;
            if (found != kNoIndex) return kNoIndex;
            found = slot_[s];
        }
        return found;
    }

  private:
    std::size_t first_slot(const Point& p) const { return hash_of(p) & (slot_.size() - 1); }

    std::span<const Point> positions_;
    std::vector<Index> slot_;
};

class Carrying {
  public:
    Carrying(const MeshAttempt& earlier, const EntityMap& entities, MeshAttempt& now,
             const Parallel& parallel)
        : earlier_(earlier), entities_(entities), now_(now), mesh_(now.fitted.mesh), parallel_(parallel) {}

    std::vector<std::uint8_t> run() {
        match();
        same_.assign(mesh_.cell_count(), 0);
        parallel_.for_each(same_.size(), kCellChunk, [&](std::size_t c) {
            same_[c] = std::all_of(mesh_.cells[c].begin(), mesh_.cells[c].end(),
                                   [&](Index v) { return match_[v] != kNoIndex; });
        });
        for (int ring = 0; ring < kRings; ++ring) withdraw_ring();
        if (std::find(same_.begin(), same_.end(), 1) == same_.end()) return {};
        place();
        withdraw_ring();
        return std::move(same_);
    }

  private:
    /// The earlier vertex of each; none where something failed.
    void match() {
        const HexMesh& old = earlier_.fitted.mesh;
        std::vector<std::uint8_t> failed(old.vertex_count(), 0);
        for (const auto* bad : {&earlier_.failed, &earlier_.low})
            for (Index c : *bad)
                for (Index v : old.cells[c]) failed[v] = 1;
        const bool known = !now_.fitted.unfitted.empty() && !earlier_.fitted.unfitted.empty();
        const std::span<const Point> key = known ? now_.fitted.unfitted : now_.start;
        const PositionTable table(known ? earlier_.fitted.unfitted : earlier_.start);
        match_.resize(mesh_.vertex_count());
        parallel_.for_each(match_.size(), kCellChunk, [&](std::size_t v) {
            const Index old_v = match_[v] = table.find(key[v]);
            if (old_v != kNoIndex &&
                (failed[old_v] ||
                 entities_(earlier_.fitted.association[old_v]) != now_.fitted.association[v] ||
                 !(glm::distance(earlier_.start[old_v], now_.start[v]) <=
                   kNear * shortest_edge(static_cast<Index>(v)))))
                match_[v] = kNoIndex;
        });
    }

    double shortest_edge(Index v) const {
        double shortest = std::numeric_limits<double>::infinity();
        for (CellCorner corner : now_.topology.vertex_cell[v]) {
            const Cell& cell = mesh_.cells[corner.cell];
            for (const auto& edge : hex::kEdgeVertex)
                if (cell[edge[0]] == v || cell[edge[1]] == v)
                    shortest = std::min(shortest,
                                        glm::distance(now_.start[cell[edge[0]]], now_.start[cell[edge[1]]]));
        }
        return shortest;
    }

    /// A ring of cells more is not the same.
    void withdraw_ring() {
        const std::vector<std::uint8_t> before = same_;
        parallel_.for_each(same_.size(), kCellChunk, [&](std::size_t c) {
            if (!before[c]) return;
            for (Index v : mesh_.cells[c])
                for (CellCorner corner : now_.topology.vertex_cell[v])
                    if (!before[corner.cell]) same_[c] = 0;
        });
    }

    /// Vertices with the same cells all round go where they were.
    void place() {
        parallel_.for_each(match_.size(), kCellChunk, [&](std::size_t v) {
            const auto cells = now_.topology.vertex_cell[v];
            const bool all_same =
                std::all_of(cells.begin(), cells.end(), [&](CellCorner c) { return same_[c.cell] != 0; });
            mesh_.positions[v] = all_same ? earlier_.fitted.mesh.positions[match_[v]] : now_.start[v];
        });
        apply_hanging(mesh_, parallel_);
    }

    const MeshAttempt& earlier_;
    const EntityMap& entities_;
    MeshAttempt& now_;
    HexMesh& mesh_;
    const Parallel& parallel_;
    std::vector<Index> match_;       ///< per vertex
    std::vector<std::uint8_t> same_; ///< per cell
};

} // namespace

std::vector<std::uint8_t> carry_positions(const MeshAttempt& earlier, const EntityMap& entities,
                                          MeshAttempt& now, const Parallel& parallel) {
    return Carrying(earlier, entities, now, parallel).run();
}

} // namespace hexopt
