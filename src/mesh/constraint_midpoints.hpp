#pragma once

#include "mesh/hex_mesh.hpp"

#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace hexopt {

/// Finds the vertices in the middle of an edge by comparing what they depend on, not where they are. Keeps a
/// reference to the mesh's constraints.
class ConstraintMidpoints {
  public:
    explicit ConstraintMidpoints(const HexMesh& mesh);

    /// Appends the hanging vertices in the middle between two vertices; usually none or one.
    void find(Index from, Index to, std::vector<Index>& found) const;

  private:
    static bool is_close(double a, double b) { return std::abs(a - b) < 1e-6; }
    std::span<const Index> masters(Index row) const {
        return {hanging_.master.data() + hanging_.offset[row],
                hanging_.offset[row + 1] - hanging_.offset[row]};
    }
    void append_half(Index v, std::vector<std::pair<Index, double>>& terms) const;
    void merge_halves(Index from, Index to, std::vector<Index>& ids, std::vector<double>& weights) const;

    const Hanging& hanging_;
    std::vector<Index> row_of_;
    std::vector<Index> order_; ///< rows sorted by their masters
};

} // namespace hexopt
