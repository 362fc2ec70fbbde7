#pragma once

#include "core/types.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace hexopt {

/// Disjoint sets of 0..count-1; each is named by its lowest member, whatever the order of joining.
class UnionFind {
  public:
    explicit UnionFind(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), Index{0});
    }
    Index find(Index i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(Index a, Index b) {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<Index> parent_;
};

} // namespace hexopt
