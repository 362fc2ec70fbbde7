#pragma once

#include "stages/trim/cell_sides.hpp"
#include "stages/trim/trim.hpp"

#include <unordered_map>
#include <utility>

namespace hexopt::trimming {

/// The set of kept cells while it is being mended.
class KeptCells {
  public:
    KeptCells(const HexMesh& mesh, const CellGraph& graph, const CellSides& sides,
              const SurfaceQueries& queries, Context& context, TrimReport& report)
        : mesh_(mesh), graph_(graph), sides_(sides), queries_(queries), context_(context), report_(report) {}

    void choose(const TrimOptions& options);
    /// Removes the shallower of two kept neighbours on either side of a gap.
    void open_gaps();
    /// Drops tips, fills pits and removes cells where the surface touches itself, until nothing is left to
    /// mend.
    void mend();
    /// Keeps the parts of the seeds' cells, or the large parts without seeds.
    void keep_parts(std::span<const Index> seed_cells, double part_fraction);

    bool is_kept(Index cell) const { return kept_[cell]; }
    std::span<const std::uint8_t> kept() const { return kept_; }
    void remove(Index cell) {
        change(cell, 0);
        removed_[cell] = 1;
    }
    void fill(Index cell) { change(cell, 1); }
    /// Keeps a cell of a thin wall, whatever it was removed for; `middle` stands for it where gaps are looked
    /// for, as its centre may be outside.
    void keep_wall(Index cell, const Point& middle) {
        change(cell, 1);
        removed_[cell] = 0;
        wall_middle_[cell] = middle;
    }
    struct State {
        std::vector<std::uint8_t> kept, removed, tip_age;
        std::vector<Index> changed;
        bool is_mended;
    };
    State state() const { return {kept_, removed_, tip_age_, changed_, is_mended_}; }
    void restore(const State& state) {
        kept_ = state.kept;
        removed_ = state.removed;
        tip_age_ = state.tip_age;
        changed_ = state.changed;
        is_mended_ = state.is_mended;
    }
    /// False for cells that were removed for a reason.
    bool may_fill(Index cell) const { return !removed_[cell]; }
    /// True for a kept cell on the surface with two opposite faces, or parts of them.
    bool is_in_layer(Index cell) const;
    /// True where kept and other cells (or the outside of the mesh) meet in a vertex.
    bool on_surface(Index vertex) const;

  private:
    struct Pair {
        Index a, b;
    };
    void gather_gaps(Index cell, std::vector<Pair>& pairs) const;
    /// True where no way from centre to centre through the quad between two cells stays inside.
    bool is_gap_between(Index a, Index b, const Quad& quad) const;
    /// Cell to remove so that the surface no longer touches itself in a vertex, or kNoIndex where it does
    /// not.
    Index find_culprit(Index vertex, std::vector<Index>& star) const;
    void change(Index cell, std::uint8_t kept) {
        if (std::exchange(kept_[cell], kept) != kept && is_mended_) changed_.push_back(cell);
    }
    /// Vertices at which the surface may touch itself: all, or those of cells changed since they were mended.
    std::vector<Index> doubtful_vertices() const;
    std::size_t mend_vertices();
    std::size_t mend_tips(bool fill_pits);
    bool shallower(Index a, Index b) const {
        return sides_.depth_h[a] != sides_.depth_h[b] ? sides_.depth_h[a] < sides_.depth_h[b] : a < b;
    }
    int count_faces(Index cell, bool towards_kept) const;

    Point point_inside(Index cell) const {
        const auto wall = wall_middle_.find(cell);
        return wall == wall_middle_.end() ? cell_centre(mesh_, cell) : wall->second;
    }

    const HexMesh& mesh_;
    const CellGraph& graph_;
    const CellSides& sides_;
    const SurfaceQueries& queries_;
    Context& context_;
    TrimReport& report_;
    std::vector<std::uint8_t> kept_;
    std::vector<std::uint8_t> removed_; ///< per cell: 1 once it has been removed, never to come back
    std::vector<std::uint8_t> tip_age_; ///< per cell: how many tips in a row ended here
    std::vector<Index> changed_;        ///< cells changed since all vertices were mended
    bool is_mended_ = false;            ///< all vertices were, but for those of changed_
    std::unordered_map<Index, Point> wall_middle_;
};

} // namespace hexopt::trimming
