#pragma once

#include "mesh/hex_mesh.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Finds the vertices in the middle of an edge by comparing what they depend on, not where they are. Keeps a
/// reference to the mesh's constraints.
class ConstraintMidpoints {
  public:
    explicit ConstraintMidpoints(const HexMesh& mesh);

    /// Appends the hanging vertices in the middle between two vertices, by rising row; usually none or one.
    void find(Index from, Index to, std::vector<Index>& found) const;

  private:
    struct Term {
        Index id;
        double weight;
    };

    std::span<const Index> masters(Index row) const {
        return {hanging_.master.data() + hanging_.offset[row],
                hanging_.offset[row + 1] - hanging_.offset[row]};
    }
    /// What half a vertex depends on: how much, and merged into the first `count` terms, which are sorted.
    std::size_t half_count(Index v) const;
    std::size_t add_half(Index v, std::span<Term> terms, std::size_t count) const;
    void find_row(std::span<const Term> terms, std::vector<Index>& found) const;

    const Hanging& hanging_;
    std::vector<Index> row_of_;
    std::vector<Index> table_; ///< rows by what they depend on: open addressing
};

} // namespace hexopt
