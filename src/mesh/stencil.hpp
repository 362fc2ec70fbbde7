#pragma once

#include "mesh/topology.hpp"

#include <array>

namespace hexopt {

/// How far each corner of a cell moves when a vertex moves by 1: 1 at the vertex itself, the constraint's
/// weight at vertices that hang on it, else 0.
using CornerWeights = std::array<double, 8>;

/// A cell of a vertex's ball: its corners move by Stencils::patterns[pattern] times the vertex's
/// displacement.
struct BallEntry {
    Index cell;
    std::uint32_t pattern;
    friend auto operator<=>(BallEntry, BallEntry) = default;
};

/// Entries of one vertex, wherever they are stored.
class BallEntries {
  public:
    explicit BallEntries(std::span<const BallEntry> own) : own_(own.data()), size_(own.size()) {}
    explicit BallEntries(std::span<const CellCorner> corners)
        : corners_(corners.data()), size_(corners.size()) {}

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    BallEntry operator[](std::size_t i) const {
        if (!corners_) return own_[i];
        return {corners_[i].cell, corners_[i].corner};
    }
    /// The topology's entries where they are not copies; else null.
    const CellCorner* corners() const { return corners_; }

    class Iterator {
      public:
        using value_type = BallEntry;
        using difference_type = std::ptrdiff_t;
        Iterator() = default;
        Iterator(const BallEntries& entries, std::size_t at) : entries_(&entries), at_(at) {}
        BallEntry operator*() const { return (*entries_)[at_]; }
        Iterator& operator++() {
            ++at_;
            return *this;
        }
        Iterator operator++(int) {
            Iterator before = *this;
            ++at_;
            return before;
        }
        bool operator==(const Iterator& other) const { return at_ == other.at_; }

      private:
        const BallEntries* entries_ = nullptr;
        std::size_t at_ = 0;
    };
    Iterator begin() const { return {*this, 0}; }
    Iterator end() const { return {*this, size_}; }

  private:
    const BallEntry* own_ = nullptr;
    const CellCorner* corners_ = nullptr;
    std::size_t size_;
};

/// Ball of every free vertex: all cells that change when it moves, also those that it touches only through
/// vertices hanging on it (method.md, thesis 4.2.1). Patterns 0..7 are the single corners, so that an entry
/// of a conforming mesh reads {cell, corner} and its stencils are the topology's own vertex_cell, not a copy.
struct Stencils {
    std::uint64_t revision = 0;
    std::vector<CornerWeights> patterns;
    Csr<BallEntry> own;                          ///< balls where vertices hang; empty for a conforming mesh
    const Csr<CellCorner>* conforming = nullptr; ///< else the topology's, which must outlive this

    /// Entries by rising cell number; none for hanging and unused vertices.
    BallEntries ball(std::size_t vertex) const {
        return conforming ? BallEntries((*conforming)[vertex]) : BallEntries(own[vertex]);
    }
    const CornerWeights& weights(BallEntry entry) const { return patterns[entry.pattern]; }
    std::size_t vertex_count() const { return conforming ? conforming->rows() : own.rows(); }
};

/// Builds the stencils of a structurally valid mesh with closed constraints. O(cells).
Stencils compute_stencils(const HexMesh& mesh, const Topology& topology);

} // namespace hexopt
